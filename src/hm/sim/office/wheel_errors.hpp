#pragma once
#include "hm/core/rng.hpp"
#include "hm/geometry/se2.hpp"

namespace hm {

/// Wheel odometry that errs as that of a real robot: fitted to the motions between the 447 scans of the first
/// half of a log of the Intel lab (0.3 to 1.1 m while it drives; 0.5 rad while it turns on the spot), against
/// the poses that GMapping found for them. Distances are measured 3.5 % long, with a deviation of 3.9 % of a
/// metre; the heading turns by 0.065 rad a metre (always to one side) with a deviation of 0.060 rad a metre;
/// a turn of 0.5 rad has a deviation of 0.036 rad. Random errors are independent, so that they grow with the
/// root of the way.
class WheelErrors {
 public:
  static constexpr double kLongRatio = 0.035, kLengthSigma = 0.039;    ///< second: m per root of a metre
  static constexpr double kVeer_rad_m = 0.065, kHeadingSigma = 0.060;  ///< second: rad per root of a metre
  static constexpr double kTurnSigma = 0.051;                          ///< rad per root of a radian

  /// The generator chooses to which side the heading turns.
  explicit WheelErrors(Rng rng) : rng_(rng), veer_rad_m_(rng_.uniform() < 0.5 ? -kVeer_rad_m : kVeer_rad_m) {}
  /// Measurement of the wheels of a motion of the base.
  SE2 measure(const SE2& motion);

 private:
  Rng rng_;
  double veer_rad_m_;
};

}  // namespace hm
