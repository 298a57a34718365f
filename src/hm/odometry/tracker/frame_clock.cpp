#include "hm/odometry/tracker/frame_clock.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "hm/core/statistics.hpp"

namespace hm {
namespace {

constexpr std::size_t kStamps = 30, kFewestStamps = 6;
constexpr double kLargestJitter = 0.2;  // standard deviation, in periods; 0.29 for arbitrary stamps

/// Numbers of the frames since the first: of those that are missing, too.
std::vector<double> frame_numbers(const std::deque<Time>& stamps) {
  std::vector<double> intervals_s;
  for (std::size_t i = 1; i < stamps.size(); ++i)
    intervals_s.push_back((stamps[i] - stamps[i - 1]).seconds());
  std::vector<double> sorted = intervals_s;
  const double period_s = middle_value(std::span(sorted));
  std::vector<double> numbers{0};
  for (const double interval_s : intervals_s)
    numbers.push_back(numbers.back() + std::max(1.0, std::round(interval_s / period_s)));
  return numbers;
}

/// Period of the straight line; nothing if the stamps are not near it.
std::optional<double> fitted_period_s(const std::deque<Time>& stamps, const std::vector<double>& numbers) {
  const auto count = static_cast<double>(stamps.size());
  double mean_number = 0, mean_s = 0;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    mean_number += numbers[i] / count;
    mean_s += (stamps[i] - stamps.front()).seconds() / count;
  }
  double squares = 0, products = 0, variance_s2 = 0;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const double number = numbers[i] - mean_number;
    const double time_s = (stamps[i] - stamps.front()).seconds() - mean_s;
    squares += number * number;
    products += number * time_s;
    variance_s2 += time_s * time_s / count;
  }
  const double period_s = products / squares;
  const double jitter_s2 = std::max(0.0, variance_s2 - period_s * products / count);
  if (!(jitter_s2 < kLargestJitter * kLargestJitter * period_s * period_s)) return std::nullopt;
  return period_s;
}

}  // namespace

void FrameClock::add(Time stamp) {
  stamps_.push_back(stamp);
  if (stamps_.size() > kStamps) stamps_.pop_front();
}

double FrameClock::interval_s(Time from, Time to) const {
  const double by_stamps_s = (to - from).seconds();
  const auto first = std::find(stamps_.begin(), stamps_.end(), from),
             last = std::find(stamps_.begin(), stamps_.end(), to);
  if (stamps_.size() < kFewestStamps || first == stamps_.end() || last == stamps_.end()) return by_stamps_s;
  const std::vector<double> numbers = frame_numbers(stamps_);
  const auto period_s = fitted_period_s(stamps_, numbers);
  if (!period_s) return by_stamps_s;
  return *period_s * (numbers[static_cast<std::size_t>(last - stamps_.begin())] -
                      numbers[static_cast<std::size_t>(first - stamps_.begin())]);
}

}  // namespace hm
