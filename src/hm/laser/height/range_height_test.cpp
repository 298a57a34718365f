// Height from single readings of a downward distance sensor.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "hm/core/rng.hpp"
#include "hm/laser/height/height_estimator.hpp"

namespace hm {
namespace {

/// Looks down from 5 cm beneath the base.
SE3 downward_sensor() {
  return SE3(Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitY())), Vec3(0.1, 0, -0.05));
}
Mat3 leaning(double roll_rad, double pitch_rad) {
  return (Eigen::AngleAxisd(roll_rad, Vec3::UnitX()) * Eigen::AngleAxisd(pitch_rad, Vec3::UnitY()))
      .toRotationMatrix();
}

/// Exact reading of the sensor over a level floor, by intersection.
double reading_m(double height_m, const Mat3& R_world_base) {
  const SE3 sensor = downward_sensor();
  const Vec3 from = R_world_base * sensor.translation(),
             along = R_world_base * sensor.rotation() * Vec3::UnitX();
  return -(height_m + from.z()) / along.z();
}

TEST(RangeDistance, IsVerticalUnderEveryAttitude) {
  for (const double roll : {-0.3, 0.0, 0.2})
    for (const double pitch : {-0.25, 0.0, 0.4}) {
      const Mat3 attitude = leaning(roll, pitch);
      const auto seen =
          range_distance({Time{}, reading_m(1.7, attitude), 0.1, 4}, downward_sensor(), attitude);
      ASSERT_EQ(seen.distances_m.size(), 1U);
      EXPECT_NEAR(seen.distances_m[0], 1.7, 1e-12);
      EXPECT_NEAR(seen.tilt_rad, std::acos(std::cos(roll) * std::cos(pitch)), 1e-12);
    }
}

TEST(RangeDistance, LeavesOutWhatIsNoReading) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const double range_m : {nan, inf, -inf, -1.0, 0.05, 4.1})
    EXPECT_TRUE(
        range_distance({Time{}, range_m, 0.1, 4}, downward_sensor(), Mat3::Identity()).distances_m.empty())
        << range_m;
  EXPECT_EQ(range_distance({Time{}, 9, 0.1, 0}, downward_sensor(), Mat3::Identity()).distances_m.size(), 1U)
      << "no upper limit given";
  const Mat3 upside_down = leaning(std::numbers::pi, 0);
  EXPECT_TRUE(range_distance({Time{}, 1, 0.1, 4}, downward_sensor(), upside_down).distances_m.empty());
  EXPECT_TRUE(
      std::isnan(range_distance({Time{}, 1, 0.1, 4}, downward_sensor(), nan * Mat3::Identity()).tilt_rad));
}

// 40 s at 50 Hz, up and down with 0.4 m/s, leaning, over a box of 0.3 m every ten seconds, one reading in ten
// lost.
TEST(RangeHeight, FollowsTheVehicleOverBoxes) {
  HeightEstimator estimator(HeightParams().for_range_sensor());
  Rng rng(3);
  double squared = 0;
  int counted = 0, up = 0, down = 0;
  for (int i = 0; i < 2000; ++i) {
    const double time = 0.02 * i, height = 1.5 + 0.4 * std::sin(time);
    const double level = std::fmod(time, 10) >= 5 && std::fmod(time, 10) < 7 ? 0.3 : 0;
    const Mat3 attitude = leaning(0.2 * std::sin(1.3 * time), 0.15 * std::cos(1.7 * time));
    const double range_m = i % 10 == 9 ? std::numeric_limits<double>::infinity()
                                       : reading_m(height - level, attitude) + rng.normal(0, 0.01);
    const auto scan =
        range_distance({Time::from_seconds(time), range_m, 0.1, 4}, downward_sensor(), attitude);
    const auto estimate = estimator.update(scan, -0.4 * std::sin(time) + rng.normal(0, 0.1));
    EXPECT_EQ(estimate.status, i % 10 == 9 ? HeightStatus::kTooFewReadings : HeightStatus::kOk);
    up += estimate.event == FloorEvent::kStepUp;
    down += estimate.event == FloorEvent::kStepDown;
    if (time < 2) continue;
    squared += (estimate.height_m - height) * (estimate.height_m - height);
    ++counted;
  }
  EXPECT_LT(std::sqrt(squared / counted), 0.015);
  EXPECT_EQ(up, 4);
  EXPECT_EQ(down, 4);
  ASSERT_EQ(estimator.profile().size(), 2U) << "each time the same box";
  EXPECT_NEAR(estimator.profile()[1].level_m, 0.3, 0.02);
}

}  // namespace
}  // namespace hm
