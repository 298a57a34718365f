#include "hm/sim/office/wheel_errors.hpp"

#include <cmath>

namespace hm {

SE2 WheelErrors::measure(const SE2& motion) {
  const double way_m = motion.translation().norm(), turn_rad = std::abs(motion.angle());
  const double length_noise_m = kLengthSigma * std::sqrt(way_m) * rng_.normal();
  const double heading_noise_rad = kHeadingSigma * std::sqrt(way_m) * rng_.normal();
  const double turn_noise_rad = kTurnSigma * std::sqrt(turn_rad) * rng_.normal();
  Vec2 moved = (1 + kLongRatio) * motion.translation();
  if (way_m > 0) moved += motion.translation() / way_m * length_noise_m;
  return {moved, motion.angle() + veer_rad_m_ * way_m + heading_noise_rad + turn_noise_rad};
}

}  // namespace hm
