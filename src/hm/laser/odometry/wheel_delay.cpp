#include "hm/laser/odometry/wheel_delay.hpp"

#include <algorithm>
#include <cmath>

#include "hm/geometry/se2.hpp"

namespace hm {
namespace {

/// Scans count for some hundred others.
constexpr double kKept = 1 - 1.0 / 300;
/// Turns count up to this: where wheels slip or a match is wrong, no delay explains it.
constexpr double kMostTurn_rad = 0.3;
/// So many scans are needed, turns of this deviation, and so much of a correlation with the wheels.
constexpr double kLeastScans = 40, kLeastTurns_rad = 0.01, kLeastCorrelation = 0.8;
/// Ratio of the covariance to that without delay.
constexpr double kClearly = 1.05;

double clamped(double turn_rad) { return std::clamp(wrap_angle(turn_rad), -kMostTurn_rad, kMostTurn_rad); }

}  // namespace

Duration WheelDelay::delay_of(std::size_t i) {
  return Duration::from_seconds(static_cast<double>(i) * kStep_s);
}

void WheelDelay::learn(Time from, Time to, double turn_rad, const Heading& heading) {
  std::array<double, kDelays> wheels_rad{};
  for (std::size_t i = 0; i < kDelays; ++i) {
    const auto first = heading(from - delay_of(i)), last = heading(to - delay_of(i));
    if (!first || !last) return;
    wheels_rad[i] = clamped(*last - *first);
  }
  const double matched_rad = clamped(turn_rad);
  for (std::size_t i = 0; i < kDelays; ++i) {
    Sums& sums = sums_[i];
    sums.wheels = kKept * sums.wheels + wheels_rad[i];
    sums.wheels2 = kKept * sums.wheels2 + wheels_rad[i] * wheels_rad[i];
    sums.product = kKept * sums.product + wheels_rad[i] * matched_rad;
  }
  scans_ = kKept * scans_ + 1;
  matched_ = kKept * matched_ + matched_rad;
  matched2_ = kKept * matched2_ + matched_rad * matched_rad;
  if (scans_ >= kLeastScans) choose();
}

/// Covariance of the turns of the wheels, so much earlier, with the matched ones.
double WheelDelay::covariance(std::size_t i) const {
  return (sums_[i].product - sums_[i].wheels * matched_ / scans_) / scans_;
}

void WheelDelay::choose() {
  std::size_t best = chosen_;
  for (std::size_t i = 0; i < kDelays; ++i)
    if (covariance(i) > covariance(best)) best = i;
  const double of_wheels = (sums_[best].wheels2 - sums_[best].wheels * sums_[best].wheels / scans_) / scans_;
  const double of_matches = (matched2_ - matched_ * matched_ / scans_) / scans_;
  const bool is_related = of_matches > kLeastTurns_rad * kLeastTurns_rad &&
                          covariance(best) > kLeastCorrelation * std::sqrt(of_wheels * of_matches);
  // At the end the true delay may lie beyond.
  if (!is_related || best + 1 == kDelays || covariance(best) < kClearly * covariance(0)) return;
  chosen_ = best;
}

}  // namespace hm
