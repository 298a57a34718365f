#pragma once
#include "hm/geometry/float/float_math.hpp"

namespace hm {

/// Bias of the gyroscopes: their mean while the vehicle stands still on the ground, over the last second or
/// two. Without it the estimated tilt is off by the bias times the time constant of the tilt filter
/// (0.5 degrees at 0.002 rad/s), which carries a vehicle without poses off.
class GyroCalibration {
 public:
  /// Samples that a mean needs, and after how many it forgets, at 1 kHz.
  static constexpr int kLeastSamples = 1000, kMostSamples = 2000;
  /// Rates that differ more from the mean are motion: the mean begins anew.
  static constexpr float kStill_rad_s = 0.05F;
  /// A larger mean is no bias, but a rotation.
  static constexpr float kMostBias_rad_s = 0.05F;

  /// Adds a finite sample, taken on the ground.
  void add(const Vec3f& rates_rad_s);
  /// Bias to subtract from the rates; zero before the first mean.
  [[nodiscard]] const Vec3f& bias_rad_s() const { return bias_; }
  /// Whether there was a mean: a vehicle that has not stood still for a second does not take off.
  [[nodiscard]] bool is_calibrated() const { return calibrated_; }

 private:
  Vec3f mean_ = Vec3f::Zero(), bias_ = Vec3f::Zero();
  int samples_ = 0;
  bool calibrated_ = false;
};

}  // namespace hm
