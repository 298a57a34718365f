#include "hm/laser/odometry/wheel_delay.hpp"

#include <algorithm>
#include <cmath>

#include "hm/geometry/se2.hpp"

namespace hm {
namespace {

/// Scans count for some hundred others.
constexpr double kKept = 1 - 1.0 / 300;
/// A deviation counts up to this: where wheels slip, no delay explains it.
constexpr double kMostDeviation_rad = 0.1;
/// So many scans are needed, and a mean deviation so much less than that of the present delay.
constexpr double kLeastScans = 40, kLessBy = 0.15, kLessBy_rad = 5e-4;

}  // namespace

Duration WheelDelay::delay_of(std::size_t i) {
  return Duration::from_seconds((static_cast<double>(i) - static_cast<double>(kNoDelay)) * kStep_s);
}

void WheelDelay::learn(Time from, Time to, double turn_rad, const Heading& heading) {
  std::array<double, kDelays> deviations{};
  for (std::size_t i = 0; i < kDelays; ++i) {
    const auto first = heading(from - delay_of(i)), last = heading(to - delay_of(i));
    if (!first || !last) return;
    deviations[i] = std::min(std::abs(wrap_angle(*last - *first - turn_rad)), kMostDeviation_rad);
  }
  for (std::size_t i = 0; i < kDelays; ++i) deviation_rad_[i] = kKept * deviation_rad_[i] + deviations[i];
  scans_ = kKept * scans_ + 1;
  if (scans_ >= kLeastScans) choose();
}

void WheelDelay::choose() {
  const auto least = std::ranges::min_element(deviation_rad_);
  const auto best = static_cast<std::size_t>(least - deviation_rad_.begin());
  const double less_rad = deviation_rad_[chosen_] - *least;
  // At the ends the true delay may lie beyond.
  if (best == 0 || best + 1 == kDelays ||
      less_rad < std::max(kLessBy * deviation_rad_[chosen_], kLessBy_rad * scans_))
    return;
  chosen_ = best;
}

}  // namespace hm
