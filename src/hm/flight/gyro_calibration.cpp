#include "hm/flight/gyro_calibration.hpp"

namespace hm {

void GyroCalibration::add(const Vec3f& rates_rad_s) {
  const Vec3f difference = rates_rad_s - mean_;
  if (samples_ > 0 && norm_f(difference) > kStill_rad_s) samples_ = 0;
  if (samples_ == 0) mean_ = rates_rad_s;
  if (samples_ < kMostSamples) ++samples_;
  mean_ += (rates_rad_s - mean_) / static_cast<float>(samples_);
  if (samples_ < kLeastSamples || !(norm_f(mean_) < kMostBias_rad_s)) return;
  bias_ = mean_;
  calibrated_ = true;
}

}  // namespace hm
