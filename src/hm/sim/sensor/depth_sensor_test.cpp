#include "hm/sim/sensor/depth_sensor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace hm {
namespace {

/// A plane seen at one depth and cosine everywhere.
RenderedView flat_view(const SensorModel& sensor, float depth_m, float cosine = 1.0f) {
  const int w = sensor.camera.width, h = sensor.camera.height;
  return {Image<float>(w, h, depth_m),
          Image<float>(w, h, cosine),
          Image<std::uint16_t>(w, h, 0),
          Image<Eigen::Vector3f>(w, h, Eigen::Vector3f::UnitZ()),
          Image<Rgb8>(w, h),
          {Reflectance::kNormal, Reflectance::kNoReturn}};
}

struct Statistics {
  double mean = 0, sigma = 0;
  std::size_t count = 0;
};

/// Statistics of the valid readings of several images.
Statistics readings(const SensorModel& sensor, const SensorEffects& effects, const RenderedView& view) {
  double sum = 0, squares = 0;
  std::size_t count = 0;
  const double reference = static_cast<double>(view.depth_m(0, 0));
  for (std::uint64_t i = 0; i < 4; ++i) {
    Rng rng(77, i);
    const DepthImage depth = sense_depth(sensor, effects, view, rng);
    for (const std::uint16_t units : depth.units.pixels()) {
      if (units == 0) continue;
      const double error = units * depth.unit_m - reference;
      sum += error, squares += error * error, ++count;
    }
  }
  const double mean = sum / static_cast<double>(count);
  return {reference + mean, std::sqrt(squares / static_cast<double>(count) - mean * mean), count};
}

/// Mean product of the errors of readings of a plane that lie so far apart, by their variance.
double correlation(const DepthImage& depth, double truth_m, int dx, int dy) {
  double products = 0, squares = 0;
  for (int y = 0; y + dy < depth.height(); ++y)
    for (int x = 0; x + dx < depth.width(); ++x) {
      const double error_m = depth.depth_m(x, y) - truth_m;
      products += error_m * (depth.depth_m(x + dx, y + dy) - truth_m), squares += error_m * error_m;
    }
  return products / squares;
}

/// As measured on walls in TUM fr1/xyz (its tuning half).
TEST(DepthSensor, CorrelatedNoiseIsThatOfAKinect) {
  SensorEffects effects = SensorEffects::none();
  effects.axial_noise = true;
  SensorModel sensor = sensor_model(SensorPreset::kKinect);
  const RenderedView view = flat_view(sensor, 1.7f);
  const Statistics independent = readings(sensor, effects, view);
  sensor.correlated_noise = true;
  const Statistics correlated = readings(sensor, effects, view);
  EXPECT_NEAR(correlated.sigma, independent.sigma, 0.01 * independent.sigma);
  EXPECT_NEAR(correlated.mean, independent.mean, 1e-4);
  Rng rng(3);
  const DepthImage depth = sense_depth(sensor, effects, view, rng);
  const auto truth_m = static_cast<double>(1.7f);
  EXPECT_NEAR(correlation(depth, truth_m, 1, 0), 0.77, 0.03);
  EXPECT_NEAR(correlation(depth, truth_m, 3, 0), 0.54, 0.07);
  EXPECT_NEAR(correlation(depth, truth_m, 5, 0), 0.34, 0.03);
  EXPECT_NEAR(correlation(depth, truth_m, 0, 1), 0.68, 0.04);
  EXPECT_NEAR(correlation(depth, truth_m, 0, 3), 0.33, 0.05);
  EXPECT_NEAR(correlation(depth, truth_m, 0, 5), 0.08, 0.09);
  EXPECT_NEAR(correlation(depth, truth_m, 12, 0), 0, 0.02);
}

TEST(DepthSensor, AxialNoiseIsUnbiasedWithTheModelsSigma) {
  SensorEffects effects = SensorEffects::none();
  effects.axial_noise = true;
  for (const SensorPreset preset : {SensorPreset::kKinect, SensorPreset::kTangoTablet}) {
    const SensorModel sensor = sensor_model(preset);
    for (const float z : {0.6f, 1.0f, 1.7f, 2.5f, 3.9f}) {
      const Statistics got = readings(sensor, effects, flat_view(sensor, z));
      const double rounding = kSimulatedDepthUnit_m / std::sqrt(12.0);
      const double sigma = std::hypot(sensor.noise.sigma_m(static_cast<double>(z)), rounding);
      const double standard_error = sigma / std::sqrt(static_cast<double>(got.count));
      EXPECT_EQ(got.count, 4 * static_cast<std::size_t>(sensor.camera.width * sensor.camera.height));
      EXPECT_NEAR(got.mean, static_cast<double>(z), 4 * standard_error) << z;
      EXPECT_NEAR(got.sigma, sigma, 0.01 * sigma) << z;
    }
  }
  // Nguyen's numbers themselves: 1.9 mm at 1 m, 6.1 mm at 2 m.
  EXPECT_NEAR(sensor_model(SensorPreset::kKinect).noise.sigma_m(2.0), 0.0012 + 0.0019 * 1.6 * 1.6, 1e-9);
}

TEST(DepthSensor, AllKinectEffectsTogetherStayUnbiased) {
  const SensorModel sensor = sensor_model(SensorPreset::kKinect);
  for (const float z : {0.8f, 1.37f, 2.2f, 3.1f}) {
    const Statistics got = readings(sensor, {}, flat_view(sensor, z));
    const double step = static_cast<double>(z * z) / sensor.disparity_step_m;
    EXPECT_NEAR(got.mean, static_cast<double>(z), 0.02 * step) << z;
    EXPECT_NEAR(got.sigma, std::hypot(sensor.noise.sigma_m(static_cast<double>(z)), step / std::sqrt(12.0)),
                0.06 * got.sigma)
        << z;
  }
}

TEST(DepthSensor, ObliqueSurfacesAreNoisier) {
  const SensorModel sensor = sensor_model(SensorPreset::kKinect);
  SensorEffects effects = SensorEffects::none();
  effects.axial_noise = true;
  const double theta = 75 * M_PI / 180;
  const Statistics got =
      readings(sensor, effects, flat_view(sensor, 1.0f, static_cast<float>(std::cos(theta))));
  const double extra = 1e-4 * theta * theta / std::pow(M_PI / 2 - theta, 2);
  EXPECT_NEAR(got.sigma, sensor.noise.sigma_m(1.0) + extra, 0.02 * got.sigma);
}

TEST(DepthSensor, QuantisationRoundsDisparity) {
  const SensorModel sensor = sensor_model(SensorPreset::kKinect);
  SensorEffects effects = SensorEffects::none();
  effects.quantisation = true;
  RenderedView view = flat_view(sensor, 0);
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 640; ++x) view.depth_m(x, y) = 2.0f + 0.001f * static_cast<float>(x);
  Rng rng(1);
  const DepthImage depth = sense_depth(sensor, effects, view, rng);
  std::set<std::uint16_t> values;
  for (int x = 0; x < 640; ++x) {
    const double z = depth.depth_m(x, 7), disparity = sensor.disparity_step_m / z;
    EXPECT_NEAR(disparity, std::round(disparity), 0.02);
    EXPECT_LE(std::abs(z - static_cast<double>(view.depth_m(x, 7))), 0.6 * z * z / sensor.disparity_step_m);
    values.insert(depth.units(x, 7));
  }
  // 1/z falls from 1/2 to 1/2.639: so many whole steps lie between.
  EXPECT_NEAR(static_cast<double>(values.size()), sensor.disparity_step_m * (1 / 2.0 - 1 / 2.639), 2);
}

TEST(DepthSensor, PhoneBiasIsPerPixelAndUpTo30CentimetresAt3Metres) {
  const SensorModel phone = sensor_model(SensorPreset::kTangoPhone);
  SensorEffects effects = SensorEffects::none();
  effects.depth_bias = true;
  const RenderedView view = flat_view(phone, 3.0f);
  Rng rng(1);
  const DepthImage depth = sense_depth(phone, effects, view, rng);
  double largest = 0;
  for (int y = 0; y < 180; ++y) {
    for (int x = 0; x < 320; ++x) {
      const double error = depth.depth_m(x, y) - 3.0;
      ASSERT_NEAR(error, depth_bias_m(phone, x, y, 3.0), 0.6 * kSimulatedDepthUnit_m);
      largest = std::max(largest, std::abs(error));
    }
  }
  EXPECT_NEAR(largest, 0.3, 0.001);
  EXPECT_EQ(depth_bias_m(sensor_model(SensorPreset::kTangoTablet), 5, 5, 3.0), 0.0);
  effects.depth_bias = false;
  Rng again(1);
  EXPECT_EQ(sense_depth(phone, effects, view, again).units(3, 3), 15000);
}

TEST(DepthSensor, GrazingAndSilentSurfacesReturnNothing) {
  const SensorModel sensor = sensor_model(SensorPreset::kTangoTablet);
  RenderedView view = flat_view(sensor, 2.0f);
  for (int y = 0; y < 180; ++y) {
    for (int x = 0; x < 320; ++x) {
      view.cos_incidence(x, y) = static_cast<float>(std::cos(x * 0.0045));
      view.part(x, y) = y < 90 ? 0 : 1;
    }
  }
  SensorEffects effects;
  effects.lateral_noise = false;
  Rng rng(1), other(1);
  const DepthImage depth = sense_depth(sensor, effects, view, rng);
  const DepthImage all = sense_depth(sensor, SensorEffects::none(), view, other);
  for (int y = 0; y < 180; ++y) {
    for (int x = 0; x < 320; ++x) {
      ASSERT_EQ(depth.units(x, y) != 0, y < 90 && x * 0.0045 < effects.grazing_limit_rad) << x << " " << y;
      ASSERT_EQ(all.units(x, y), 10000);
    }
  }
}

TEST(DepthSensor, LateralNoiseMovesEdgesOnly) {
  const SensorModel sensor = sensor_model(SensorPreset::kKinect);
  SensorEffects effects = SensorEffects::none();
  effects.lateral_noise = true;
  RenderedView view = flat_view(sensor, 1.0f);
  for (int y = 0; y < 480; ++y)
    for (int x = 320; x < 640; ++x) view.depth_m(x, y) = 2.0f;
  Rng rng(5);
  const DepthImage depth = sense_depth(sensor, effects, view, rng);
  int left_far = 0, right_near = 0;
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 640; ++x) {
      const std::uint16_t units = depth.units(x, y);
      ASSERT_TRUE(units == 5000 || units == 10000);
      ASSERT_TRUE(x >= 315 || units == 5000);
      ASSERT_TRUE(x < 325 || units == 10000);
      left_far += x < 320 && units == 10000;
      right_near += x >= 320 && units == 5000;
    }
  }
  // A pixel changes sides when its shift rounds to at least its distance from the edge.
  double expected = 0;
  for (int k = 1; k < 5; ++k)
    expected += 480 * 0.5 * std::erfc((k - 0.5) / (sensor.lateral_sigma_px * std::sqrt(2.0)));
  EXPECT_NEAR(left_far, expected, 4 * std::sqrt(expected));
  EXPECT_NEAR(right_near, expected, 4 * std::sqrt(expected));
}

TEST(DepthSensor, RangeIsJudgedByTheTrueDepth) {
  const SensorModel sensor = sensor_model(SensorPreset::kKinect);
  for (const float z : {0.0f, 0.39f, 5.01f, 9.0f}) {
    Rng rng(1);
    const DepthImage depth = sense_depth(sensor, {}, flat_view(sensor, z), rng);
    for (const std::uint16_t units : depth.units.pixels()) ASSERT_EQ(units, 0);
  }
  EXPECT_EQ(readings(sensor, {}, flat_view(sensor, 4.99f)).count, 4u * 640 * 480);
}

TEST(DepthSensor, OneSwitchLeavesTheNoiseOfAnotherAlone) {
  const SensorModel sensor = sensor_model(SensorPreset::kTangoTablet);
  SensorEffects effects = SensorEffects::none();
  effects.axial_noise = true;
  Rng a(9), b(9);
  const DepthImage without = sense_depth(sensor, effects, flat_view(sensor, 1.5f), a);
  effects.lateral_noise = effects.grazing_dropout = true;
  const DepthImage with = sense_depth(sensor, effects, flat_view(sensor, 1.5f), b);
  EXPECT_TRUE(std::ranges::equal(without.units.pixels(), with.units.pixels()));
}

}  // namespace
}  // namespace hm
