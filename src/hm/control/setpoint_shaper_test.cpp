#include "hm/control/setpoint_shaper.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

constexpr FlightModes kPosition{AxisMode::kPosition, AxisMode::kPosition, AxisMode::kPosition};
constexpr FlightModes kVelocity{AxisMode::kVelocity, AxisMode::kVelocity, AxisMode::kVelocity};

MotionGoal goal_at(const Vec3f& position, float yaw = 0) {
  MotionGoal goal;
  goal.position_m = position;
  goal.yaw_rad = yaw;
  return goal;
}

SetpointShaper shaper_at(const Vec3f& position) {
  SetpointShaper shaper({}, 0.001F);
  MotionReference start;
  start.position_m = position;
  shaper.start_from(start);
  return shaper;
}

TEST(SetpointShaper, FliesStraightAndSmoothlyToAGoal) {
  SetpointShaper shaper = shaper_at({1, 2, 1});
  const Vec3f to(4, -2, 2);
  MotionReference before = shaper.reference();
  float most_speed = 0;
  for (int i = 0; i < 6000; ++i) {
    const MotionReference now = shaper.step(kPosition, goal_at(to), before.position_m, 0);
    // distance from the line between start and goal
    const float along = (now.position_m.x() - 1) * 0.6F - (now.position_m.y() - 2) * 0.8F;
    ASSERT_NEAR(now.position_m.x(), 1 + 0.6F * along, 1e-4F);
    ASSERT_NEAR(now.position_m.y(), 2 - 0.8F * along, 1e-4F);
    most_speed = std::max(most_speed, norm_f(now.velocity_m_s.x(), now.velocity_m_s.y()));
    ASSERT_LE(norm_f(Vec3f(now.acceleration_m_s2 - before.acceleration_m_s2)), 1.42F * 8e-3F);
    ASSERT_LE((now.position_m - before.position_m - 0.001F * now.velocity_m_s).norm(), 1e-4F);
    before = now;
  }
  EXPECT_NEAR(most_speed, 1.5F, 1e-3F);
  EXPECT_EQ(before.position_m, to);
  EXPECT_EQ(before.velocity_m_s, Vec3f(0, 0, 0));
}

TEST(SetpointShaper, GoalsThatJumpAboutGiveAMotionWithinLimits) {
  Rng rng(5);
  SetpointShaper shaper = shaper_at({0, 0, 1});
  MotionReference before = shaper.reference();
  Vec3f to(0, 0, 1);
  for (int i = 0; i < 60000; ++i) {
    if (i % 300 == 0)
      to = {static_cast<float>(rng.uniform(-3, 3)), static_cast<float>(rng.uniform(-3, 3)),
            static_cast<float>(rng.uniform(0.5, 3))};
    const MotionReference now = shaper.step(kPosition, goal_at(to), before.position_m, 0);
    ASSERT_LE(norm_f(now.acceleration_m_s2.x(), now.acceleration_m_s2.y()), 1.4143F * 2.5F);
    ASSERT_LE(norm_f(now.velocity_m_s.x(), now.velocity_m_s.y()), 1.4143F * 1.5F);
    ASSERT_LE(now.velocity_m_s.z(), 1.001F);
    ASSERT_GE(now.velocity_m_s.z(), -0.701F);
    ASSERT_LE(norm_f(now.acceleration_m_s2.x() - before.acceleration_m_s2.x(),
                     now.acceleration_m_s2.y() - before.acceleration_m_s2.y()),
              1.4143F * 8e-3F * 1.05F);
    ASSERT_LE((now.position_m - before.position_m).norm(), 2.5e-3F);
    before = now;
  }
}

TEST(SetpointShaper, ASlowlyMovingGoalIsFollowedWithoutJumps) {
  SetpointShaper shaper = shaper_at({0, 0, 1});
  MotionReference before = shaper.reference();
  for (int i = 0; i < 8000; ++i) {
    const Vec3f to(0.0005F * static_cast<float>(i), 0, 1);  // 0.5 m/s
    const MotionReference now = shaper.step(kPosition, goal_at(to), before.position_m, 0);
    ASSERT_NEAR(now.position_m.x() - before.position_m.x(),
                0.0005F * (now.velocity_m_s.x() + before.velocity_m_s.x()), 1e-5F);
    ASSERT_LE(std::abs(now.acceleration_m_s2.x() - before.acceleration_m_s2.x()), 8e-3F * 1.05F + 2e-2F);
    before = now;
  }
  EXPECT_NEAR(before.velocity_m_s.x(), 0.5F, 0.06F);
  EXPECT_NEAR(before.position_m.x(), 4, 0.15F) << "behind by its stopping distance";
}

TEST(SetpointShaper, FarFromTheOriginItStillArrives) {
  const Vec3f origin(3000, -2000, 100);
  SetpointShaper shaper = shaper_at(origin);
  const Vec3f to = origin + Vec3f(1, 0.5F, -0.25F);
  for (int i = 0; i < 4000; ++i) shaper.step(kPosition, goal_at(to), origin, 0);
  EXPECT_EQ(shaper.reference().position_m, to);
  EXPECT_EQ(shaper.reference().velocity_m_s, Vec3f(0, 0, 0));
}

TEST(SetpointShaper, ReleasedInVelocityModeItComesToRestWhereItSaid) {
  SetpointShaper shaper = shaper_at({0, 0, 1});
  MotionGoal goal;
  goal.velocity_m_s = {1, -0.5F, 0.3F};
  goal.yaw_rate_rad_s = 0.5F;
  Vec3f at(0, 0, 1);
  for (int i = 0; i < 2000; ++i) at += 0.001F * shaper.step(kVelocity, goal, at, 0).velocity_m_s;
  EXPECT_LT((shaper.reference().velocity_m_s - goal.velocity_m_s).norm(), 1e-5F);
  EXPECT_EQ(shaper.reference().yaw_rate_rad_s, 0.5F);
  const Vec3f stop = shaper.stopping_point();
  goal.velocity_m_s.setZero();
  for (int i = 0; i < 2000; ++i) at += 0.001F * shaper.step(kVelocity, goal, at, 0).velocity_m_s;
  EXPECT_EQ(shaper.reference().velocity_m_s, Vec3f(0, 0, 0));
  EXPECT_LT((at - stop).norm(), 0.005F);
  goal.velocity_m_s = {30, 40, 0};
  for (int i = 0; i < 3000; ++i) shaper.step(kVelocity, goal, at, 0);
  EXPECT_LT((shaper.reference().velocity_m_s - Vec3f(0.9F, 1.2F, 0)).norm(), 1e-4F) << "the direction stays";
}

TEST(SetpointShaper, YawTakesTheShorterWayRound) {
  SetpointShaper shaper({}, 0.001F);
  MotionReference start;
  start.yaw_rad = 3;
  shaper.start_from(start);
  float turned = 0, before = 3;
  for (int i = 0; i < 4000; ++i) {
    const float yaw = shaper.step(kPosition, goal_at({0, 0, 0}, -3), {0, 0, 0}, 3).yaw_rad;
    turned += wrap_angle_f(yaw - before);
    before = yaw;
    ASSERT_LE(std::abs(shaper.reference().yaw_rate_rad_s), 1.001F);
  }
  EXPECT_NEAR(turned, 2 * kPiF - 6, 1e-3F);
  EXPECT_NEAR(before, -3, 1e-4F);
}

TEST(SetpointShaper, LimitsForTheMoment) {
  SetpointShaper shaper = shaper_at({0, 0, 1});
  shaper.limit_speed(0.3F, 10, 0.1F);
  float fastest = 0, sinking = 0;
  for (int i = 0; i < 6000; ++i) {
    const MotionReference& now = shaper.step(kPosition, goal_at({1, 0, 0.8F}), {0, 0, 1}, 0);
    fastest = std::max(fastest, now.velocity_m_s.x());
    sinking = std::min(sinking, now.velocity_m_s.z());
  }
  EXPECT_NEAR(fastest, 0.3F, 1e-4F);
  EXPECT_NEAR(sinking, -0.1F, 1e-4F);
  EXPECT_LT((shaper.reference().position_m - Vec3f(1, 0, 0.8F)).norm(), 1e-6F);
}

}  // namespace
}  // namespace hm
