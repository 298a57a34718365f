#include "hm/flight/gyro_calibration.hpp"

#include <gtest/gtest.h>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

Vec3f noisy(const Vec3f& mean, Rng& rng) {
  Vec3f rates = mean;
  for (float& rate : rates) rate += static_cast<float>(rng.normal(0, 0.006));
  return rates;
}

TEST(GyroCalibration, FindsTheBiasOfAVehicleThatStands) {
  GyroCalibration calibration;
  Rng rng(1);
  const Vec3f bias(0.003F, -0.002F, 0.001F);
  for (int i = 0; i < GyroCalibration::kLeastSamples - 1; ++i) calibration.add(noisy(bias, rng));
  EXPECT_EQ(calibration.bias_rad_s(), Vec3f::Zero());
  EXPECT_FALSE(calibration.is_calibrated());
  for (int i = 0; i < 2000; ++i) calibration.add(noisy(bias, rng));
  EXPECT_LT(norm_f(Vec3f(calibration.bias_rad_s() - bias)), 6e-4F);
  EXPECT_TRUE(calibration.is_calibrated());
}

TEST(GyroCalibration, MotionIsNoBias) {
  GyroCalibration calibration;
  Rng rng(2);
  for (int i = 0; i < 3000; ++i) calibration.add(noisy({0, 0, 0.2F}, rng));  // carried, turning
  EXPECT_EQ(calibration.bias_rad_s(), Vec3f::Zero());
  EXPECT_FALSE(calibration.is_calibrated());
  const Vec3f bias(0, 0.004F, 0);
  for (int i = 0; i <= 1000; ++i) calibration.add(noisy(bias, rng));
  const Vec3f found = calibration.bias_rad_s();
  EXPECT_LT(norm_f(Vec3f(found - bias)), 8e-4F);
  for (int i = 0; i < 400; ++i) calibration.add(noisy({0.1F, 0, 0}, rng));  // picked up: the bias stays
  EXPECT_EQ(calibration.bias_rad_s(), found);
}

}  // namespace
}  // namespace hm
