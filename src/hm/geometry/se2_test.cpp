#include "hm/geometry/se2.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

constexpr double kPi = std::numbers::pi;

SE2 random_motion(Rng& rng) { return {rng.uniform(-9, 9), rng.uniform(-9, 9), rng.uniform(-3.1, 3.1)}; }

TEST(WrapAngle, StaysInTheHalfOpenCircle) {
  EXPECT_DOUBLE_EQ(wrap_angle(kPi), kPi);
  EXPECT_DOUBLE_EQ(wrap_angle(-kPi), kPi);
  EXPECT_NEAR(wrap_angle(3 * kPi + 0.1), -kPi + 0.1, 1e-12);
  EXPECT_NEAR(wrap_angle(-200 * kPi - 0.3), -0.3, 1e-12);
}

TEST(Se2, ComposesAndInvertsLikeItsMotionInSpace) {
  Rng rng(1);
  for (int i = 0; i < 200; ++i) {
    const SE2 a = random_motion(rng), b = random_motion(rng);
    const Vec2 p(rng.uniform(-5, 5), rng.uniform(-5, 5));
    const Vec3 in_space = a.to_se3(0.5) * (b.to_se3() * Vec3(p.x(), p.y(), 0));
    EXPECT_NEAR((a * b * p - in_space.head<2>()).norm(), 0, 1e-12);
    EXPECT_NEAR(in_space.z(), 0.5, 1e-12);
    EXPECT_NEAR((a.inverse() * (a * p) - p).norm(), 0, 1e-12);
    EXPECT_NEAR((SE2::from_se3(a.to_se3(2)).vector() - a.vector()).norm(), 0, 1e-12);
  }
}

TEST(Se2, LogIsTheInverseOfExp) {
  Rng rng(2);
  for (const double scale : {1.0, 1e-3, 1e-5, 1e-9})
    for (int i = 0; i < 100; ++i) {
      const Vec3 twist(rng.uniform(-5, 5), rng.uniform(-5, 5), scale * rng.uniform(-3.1, 3.1));
      EXPECT_NEAR((SE2::exp(twist).log() - twist).norm(), 0, 1e-9);
    }
}

TEST(Se2, ExpIsManySmallSteps) {
  const Vec3 twist(0.7, -0.4, 1.9);
  SE2 steps;
  constexpr int kSteps = 100000;
  for (int i = 0; i < kSteps; ++i)
    steps = steps * SE2(twist.x() / kSteps, twist.y() / kSteps, twist.z() / kSteps);
  EXPECT_NEAR((steps.vector() - SE2::exp(twist).vector()).norm(), 0, 1e-4);
}

TEST(RollPitchYaw, RoundTrips) {
  Rng rng(3);
  for (int i = 0; i < 200; ++i) {
    const Vec3 angles(rng.uniform(-3, 3), rng.uniform(-1.5, 1.5), rng.uniform(-3, 3));
    EXPECT_NEAR((roll_pitch_yaw(rotation_from_roll_pitch_yaw(angles)) - angles).norm(), 0, 1e-9);
  }
}

TEST(RollPitchYaw, TurnsAboutTheAxesInTurn) {
  const Vec3 angles(0.3, -0.2, 1.1);
  const Mat3 in_turn = so3_exp({0, 0, 1.1}) * so3_exp({0, -0.2, 0}) * so3_exp({0.3, 0, 0});
  EXPECT_NEAR((rotation_from_roll_pitch_yaw(angles) - in_turn).norm(), 0, 1e-12);
}

}  // namespace
}  // namespace hm
