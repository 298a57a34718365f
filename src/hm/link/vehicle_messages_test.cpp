#include "hm/link/vehicle_messages.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "hm/link/codec/mavlink_enums.hpp"

namespace hm {
namespace {

constexpr double kQuarter = std::numbers::pi / 2;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr Time kBoot = Time{5'000'000'000};

LinkState flying_state() {
  LinkState state;
  state.stamp = Time{6'234'567'000};
  state.T_odom_base = SE3(Eigen::Quaterniond(Eigen::AngleAxisd(kQuarter, Vec3::UnitZ())), Vec3(1, 2, 3));
  state.velocity_body = Vec3(0.5, 0.25, -0.125);
  state.rates_body = Vec3(0.1, 0.2, 0.3);
  state.pose_covariance = Mat6(Mat6::Identity() * 0.01);
  state.reset_counter = 7;
  return state;
}

TEST(VehicleMessages, OdometryIsWhatPx4AndArduPilotAccept) {
  const auto message = to_odometry(flying_state());
  ASSERT_TRUE(message);
  EXPECT_EQ(message->time_usec, 6'234'567U);
  EXPECT_EQ(message->frame_id, 20);
  EXPECT_EQ(message->child_frame_id, 12);
  EXPECT_EQ(message->estimator_type, 2);
  EXPECT_EQ(message->reset_counter, 7);
  EXPECT_FLOAT_EQ(message->x, 1);
  EXPECT_FLOAT_EQ(message->y, -2);
  EXPECT_FLOAT_EQ(message->z, -3);
  EXPECT_FLOAT_EQ(message->q[0], static_cast<float>(std::sqrt(0.5)));
  EXPECT_FLOAT_EQ(message->q[3], -static_cast<float>(std::sqrt(0.5)));
  EXPECT_FLOAT_EQ(message->vy, -0.25F);
  EXPECT_FLOAT_EQ(message->yawspeed, -0.3F);
  for (const std::size_t place : {0, 6, 11, 15, 18, 20})
    EXPECT_FLOAT_EQ(message->pose_covariance[place], 0.01F);
  EXPECT_TRUE(std::isnan(message->velocity_covariance[0]));
}

TEST(VehicleMessages, OdometryComesBack) {
  const LinkState sent = flying_state();
  const auto received = from_odometry(*to_odometry(sent));
  ASSERT_TRUE(received);
  EXPECT_EQ(received->stamp.ns, sent.stamp.ns);
  EXPECT_LT((received->T_odom_base.inverse() * sent.T_odom_base).log().norm(), 1e-6);
  EXPECT_TRUE(received->velocity_body.isApprox(sent.velocity_body, 1e-6));
  EXPECT_TRUE(received->rates_body.isApprox(sent.rates_body, 1e-6));
  EXPECT_TRUE(received->pose_covariance->isApprox(*sent.pose_covariance, 1e-6));
  EXPECT_FALSE(received->velocity_covariance);
}

TEST(VehicleMessages, WhatIsNotFiniteIsNeverSent) {
  LinkState state = flying_state();
  state.velocity_body.y() = kNan;
  EXPECT_FALSE(to_odometry(state));
  EXPECT_FALSE(to_vision_position(state, AutopilotWorld::kNed));
  state = flying_state();
  (*state.pose_covariance)(2, 2) = -1;
  EXPECT_FALSE(to_odometry(state));
  state = flying_state();
  state.T_odom_base = SE3(Mat3::Identity(), Vec3(0, kNan, 0));
  EXPECT_FALSE(to_odometry(state));
  LinkSetPoint set_point;
  EXPECT_FALSE(to_position_target(set_point, kBoot, kBoot, AutopilotWorld::kNed));
  set_point.velocity_m_s = Vec3(0, 0, kNan);
  EXPECT_FALSE(to_position_target(set_point, kBoot, kBoot, AutopilotWorld::kNed));
  EXPECT_FALSE(to_attitude_target({{}, {}, 1.5}, kBoot, kBoot, AutopilotWorld::kNed));
}

TEST(VehicleMessages, FaultyOdometryIsNamed) {
  MavOdometry message = *to_odometry(flying_state());
  EXPECT_EQ(odometry_fault(message), "");
  message.frame_id = kMavFrameLocalNed;
  EXPECT_EQ(odometry_fault(message), "frame_id is not LOCAL_FRD (20)");
  message = *to_odometry(flying_state());
  message.child_frame_id = kMavFrameBodyNed;
  EXPECT_EQ(odometry_fault(message), "child_frame_id is not BODY_FRD (12)");
  message = *to_odometry(flying_state());
  message.q = {0, 0, 0, 0};
  EXPECT_EQ(odometry_fault(message), "the quaternion's length is not 1");
  EXPECT_FALSE(from_odometry(message));
}

TEST(VehicleMessages, TelemetryIsInNed) {
  const LinkState state = flying_state();
  const auto position = to_local_position(state, kBoot, AutopilotWorld::kNed);
  EXPECT_EQ(position.time_boot_ms, 1234U);
  EXPECT_FLOAT_EQ(position.x, 2);
  EXPECT_FLOAT_EQ(position.y, 1);
  EXPECT_FLOAT_EQ(position.z, -3);
  EXPECT_FLOAT_EQ(position.vx, 0.5F);    // forward is north
  EXPECT_FLOAT_EQ(position.vy, -0.25F);  // left is west
  EXPECT_FLOAT_EQ(position.vz, 0.125F);
  const auto attitude = to_attitude(state, kBoot, AutopilotWorld::kNed);
  EXPECT_NEAR(attitude.yaw, 0, 1e-6);
  EXPECT_FLOAT_EQ(attitude.pitchspeed, -0.2F);
  EXPECT_FLOAT_EQ(to_attitude_quaternion(state, kBoot, AutopilotWorld::kNed).q1, 1);
  EXPECT_NEAR(to_vision_position(state, AutopilotWorld::kLocalFrd)->yaw, -kQuarter, 1e-6);
}

TEST(VehicleMessages, SetPointsComeBackWithWhatIsIgnored) {
  for (const auto world : {AutopilotWorld::kNed, AutopilotWorld::kLocalFrd})
    for (unsigned given = 1; given < 32; ++given) {
      LinkSetPoint sent;
      if (given & 1U) sent.position_m = Vec3(1, 2, 3);
      if (given & 2U) sent.velocity_m_s = Vec3(-1, 0.5, 0.25);
      if (given & 4U) sent.acceleration_m_s2 = Vec3(0, 1, 2);
      if (given & 8U) sent.yaw_rad = 0.75;
      if (given & 16U) sent.yaw_rate_rad_s = -0.5;
      const auto message = to_position_target(sent, kBoot, kBoot, world);
      ASSERT_TRUE(message);
      EXPECT_EQ(message->coordinate_frame, kMavFrameLocalNed);
      const auto received = from_position_target(*message, world);
      ASSERT_TRUE(received);
      EXPECT_EQ(received->position_m, sent.position_m);
      EXPECT_EQ(received->velocity_m_s, sent.velocity_m_s);
      EXPECT_EQ(received->acceleration_m_s2, sent.acceleration_m_s2);
      ASSERT_EQ(received->yaw_rad.has_value(), sent.yaw_rad.has_value());
      EXPECT_NEAR(received->yaw_rad.value_or(0), sent.yaw_rad.value_or(0), 1e-6);
      EXPECT_EQ(received->yaw_rate_rad_s, sent.yaw_rate_rad_s);
    }
  // Velocity only, as PX4's documents have it.
  LinkSetPoint velocity;
  velocity.velocity_m_s = Vec3::Zero();
  EXPECT_EQ(to_position_target(velocity, kBoot, kBoot, AutopilotWorld::kNed)->type_mask, 0xDC7);
}

TEST(VehicleMessages, AttitudeTargetsComeBack) {
  LinkAttitudeSetPoint sent;
  sent.q_odom_base = Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized()));
  sent.thrust = 0.485;
  const auto message = to_attitude_target(sent, kBoot, kBoot, AutopilotWorld::kNed);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->type_mask, 7);
  const auto received = from_attitude_target(*message, AutopilotWorld::kNed);
  ASSERT_TRUE(received && received->q_odom_base);
  EXPECT_LT(received->q_odom_base->angularDistance(*sent.q_odom_base), 1e-6);
  EXPECT_FALSE(received->rates_body);
  EXPECT_NEAR(*received->thrust, 0.485, 1e-6);
}

TEST(VehicleMessages, SticksPointTheWayOurBodyDoes) {
  MavManualControl message;
  message.x = 500;     // forward
  message.y = 1000;    // right
  message.z = 750;     // up
  message.r = -30000;  // counter-clockwise, out of range
  message.buttons = 5;
  const LinkSticks sticks = from_manual_control(message);
  EXPECT_DOUBLE_EQ(sticks.forward, 0.5);
  EXPECT_DOUBLE_EQ(sticks.left, -1);
  EXPECT_DOUBLE_EQ(sticks.up, 0.5);
  EXPECT_DOUBLE_EQ(sticks.turn, 1);
  EXPECT_EQ(sticks.buttons, 5);
  message.r = 32767;
  EXPECT_EQ(from_manual_control(message).turn, 0);
}

}  // namespace
}  // namespace hm
