#include "hm/pipeline/laser/laser_motion.hpp"

#include <gtest/gtest.h>

namespace hm {
namespace {

/// A vehicle that begins to turn at 1 s: 0.4 m/s ahead, then 1.5 rad/s as well; read ten times a second.
LaserMotion begins_to_turn() {
  LaserMotion motion({}, SE3(), Duration::from_seconds(1));
  SE2 pose;
  for (int i = 0; i <= 20; ++i) {
    motion.add_odometry({Time::from_seconds(0.1 * i), pose.to_se3()});
    pose = pose * SE2::exp(Vec3(0.04, 0, i < 10 ? 0 : 0.15));
  }
  return motion;
}

TEST(LaserMotion, OdometryTellsTheVelocityOfASweep) {
  const LaserMotion motion = begins_to_turn();
  const auto velocity = [&](double begin_s, double end_s) {
    return motion.odometry_velocity(Time::from_seconds(begin_s), Time::from_seconds(end_s));
  };
  ASSERT_TRUE(velocity(0.42, 0.48));
  EXPECT_LT((*velocity(0.42, 0.48) - Vec3(0.4, 0, 0)).norm(), 1e-6);
  // Of this sweep, not of the motion before it.
  ASSERT_TRUE(velocity(1.01, 1.07));
  EXPECT_LT((*velocity(1.01, 1.07) - Vec3(0.4, 0, 1.5)).norm(), 0.04);
  EXPECT_FALSE(velocity(1.98, 2.04)) << "beyond the last reading";
  EXPECT_FALSE(velocity(1.5, 1.5)) << "beams at one moment";
}

TEST(LaserMotion, OdometryThatIsReadSeldomOrJumpsTellsNoVelocity) {
  LaserMotion seldom({}, SE3(), Duration::from_seconds(1));
  for (int i = 0; i < 4; ++i) seldom.add_odometry({Time::from_seconds(0.5 * i), SE2(0.2 * i, 0, 0).to_se3()});
  EXPECT_FALSE(seldom.odometry_velocity(Time::from_seconds(0.6), Time::from_seconds(0.7)));
  LaserMotion jumps = begins_to_turn();
  jumps.add_odometry({Time::from_seconds(2.1), SE2(50, 0, 0).to_se3()});
  EXPECT_FALSE(jumps.odometry_velocity(Time::from_seconds(2.02), Time::from_seconds(2.08)));
  EXPECT_TRUE(jumps.odometry_velocity(Time::from_seconds(1.92), Time::from_seconds(1.98)));
}

/// Level and still for a second, then upwards with 2 m/s^2; 200 readings a second, in other units on demand.
LaserMotion begins_to_climb(double unit_m_s2 = 1) {
  LaserMotion motion({}, SE3(), Duration::from_seconds(1));
  for (int i = 0; i <= 400; ++i) {
    ImuSample sample;
    sample.stamp = Time::from_seconds(0.005 * i);
    sample.specific_force_m_s2 = Vec3(0, 0, kGravity_m_s2 + (i > 200 ? 2 : 0)) / unit_m_s2;
    sample.R_world_imu = Mat3::Identity();
    motion.add_imu(sample);
  }
  return motion;
}

TEST(LaserMotion, AnImuTellsTheUpwardAcceleration) {
  const LaserMotion motion = begins_to_climb();
  const auto mean = [&](double begin_s, double end_s) {
    return motion.upward_acceleration(Time::from_seconds(begin_s), Time::from_seconds(end_s));
  };
  ASSERT_TRUE(mean(0.301, 0.326) && mean(0.9, 1.1) && mean(1.303, 1.328));
  EXPECT_NEAR(*mean(0.301, 0.326), 0, 1e-9);
  EXPECT_NEAR(*mean(0.9, 1.1), 1, 1e-6);
  EXPECT_NEAR(*mean(1.303, 1.328), 2, 1e-6);
  EXPECT_FALSE(mean(1.99, 2.01)) << "beyond the last sample";
  EXPECT_FALSE(mean(-0.01, 0.1)) << "before the first";
  EXPECT_FALSE(mean(0.5, 0.5));
  EXPECT_FALSE(
      begins_to_climb(kGravity_m_s2).upward_acceleration(Time::from_seconds(0.3), Time::from_seconds(0.4)))
      << "in units of g: no acceleration";
}

}  // namespace
}  // namespace hm
