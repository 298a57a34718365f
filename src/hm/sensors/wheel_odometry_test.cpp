#include "hm/sensors/wheel_odometry.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/geometry/se2.hpp"

namespace hm {
namespace {

Trajectory circle(int poses) {
  Trajectory path;
  SE2 T;
  for (int i = 0; i < poses; ++i) {
    path.push_back({Time::from_seconds(i), T.to_se3(0.3)});
    T = T * SE2(0.1, 0, 0.05);
  }
  return path;
}

WheelNoiseParams none() { return {0, 0, 0, 0, 0, 0, 1}; }

TEST(WheelOdometry, WithoutNoiseItIsTheTruth) {
  const Trajectory truth = circle(200), odometry = degrade_to_wheel_odometry(truth, none());
  ASSERT_EQ(odometry.size(), truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_EQ(odometry[i].stamp, truth[i].stamp);
    const SE2 error =
        SE2::from_se3(truth[i].T_world_base).inverse() * SE2::from_se3(odometry[i].T_world_base);
    EXPECT_LT(error.vector().norm(), 1e-9);
  }
}

/// Steps of 0.1 m: the noise along, across and of the angle has the stated deviation.
TEST(WheelOdometry, NoiseHasTheStatedDeviation) {
  WheelNoiseParams params = none();
  params.along_ratio = 0.05;
  params.across_ratio = 0.02;
  params.angle_ratio = 0.1;
  params.angle_rad_per_m = 0.2;
  const Trajectory truth = circle(20001), odometry = degrade_to_wheel_odometry(truth, params);
  Vec3 sum = Vec3::Zero(), squares = Vec3::Zero();
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const SE2 motion =
        SE2::from_se3(odometry[i - 1].T_world_base).inverse() * SE2::from_se3(odometry[i].T_world_base);
    const Vec3 error = motion.vector() - Vec3(0.1, 0, 0.05);
    sum += error;
    squares += error.cwiseAbs2();
  }
  const Vec3 deviation = (squares / 20000).cwiseSqrt();
  EXPECT_LT((sum / 20000).norm(), 5e-4);
  EXPECT_NEAR(deviation.x(), 0.005, 0.0002);
  EXPECT_NEAR(deviation.y(), 0.002, 0.0001);
  EXPECT_NEAR(deviation.z(), std::hypot(0.1 * 0.05, 0.2 * 0.1), 0.0005);
}

TEST(WheelOdometry, ItsStrengthIsAFactorOfAllErrors) {
  const Trajectory truth = circle(100);
  const auto end = [&](const WheelNoiseParams& params) {
    return degrade_to_wheel_odometry(truth, params).back().T_world_base;
  };
  WheelNoiseParams params;
  params.strength = 0;
  EXPECT_LT((end(params).inverse() * end(none())).log().norm(), 1e-9);
  params.strength = 0.1;
  EXPECT_LT((end(params).inverse() * end({0.005, 0.002, 0.005, 0.002, 0.001, 0.001, 1})).log().norm(), 1e-9);
  EXPECT_GT((end(params).inverse() * end(none())).log().norm(), 1e-3);
}

TEST(WheelOdometry, ReproducibleBySeed) {
  const Trajectory truth = circle(100);
  WheelNoiseParams params;
  const SE3 end = degrade_to_wheel_odometry(truth, params).back().T_world_base;
  EXPECT_EQ(degrade_to_wheel_odometry(truth, params).back().T_world_base.matrix(), end.matrix());
  params.seed = 2;
  EXPECT_NE(degrade_to_wheel_odometry(truth, params).back().T_world_base.matrix(), end.matrix());
  EXPECT_TRUE(degrade_to_wheel_odometry({}, params).empty());
}

}  // namespace
}  // namespace hm
