#include "hm/control/jerk_limited_axis.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

constexpr float kPeriod_s = 0.001F;
const AxisLimits kLimits;  // 1.5, 2.5, 8

/// Duration of the time-optimal motion from rest to rest over a distance, closed form (three or seven
/// phases).
double optimal_duration(double distance, double v, double a, double j) {
  const double tj = a / j;
  if (distance <= 2 * a * tj * tj && std::cbrt(distance / (2 * j)) <= tj &&
      j * std::pow(distance / (2 * j), 2. / 3) <= v)
    return 4 * std::cbrt(distance / (2 * j));
  const double peak =
      0.5 * (-a * tj + std::sqrt(a * a * tj * tj + 4 * a * distance));  // without the speed limit
  if (peak <= v) return 2 * (peak / a + tj);
  return distance / v + v / a + tj;
}

struct Course {
  int steps = 0;
  float most_speed = 0, most_acceleration = 0, most_jerk = 0, overshoot = 0;
};

Course run_to_goal(JerkLimitedAxis& axis, const AxisLimits& limits, int steps) {
  Course run;
  const float sign = axis.state().to_go < 0 ? -1.0F : 1.0F;
  for (int i = 0; i < steps; ++i) {
    const auto before = axis.state();
    axis.step_to_goal(limits, kPeriod_s);
    const auto& now = axis.state();
    run.most_speed = std::max(run.most_speed, std::abs(now.velocity));
    run.most_acceleration = std::max(run.most_acceleration, std::abs(now.acceleration));
    run.most_jerk = std::max(run.most_jerk, std::abs(now.acceleration - before.acceleration) / kPeriod_s);
    run.overshoot = std::max(run.overshoot, -sign * now.to_go);
    if (now.to_go != 0 || now.velocity != 0) run.steps = i + 1;
  }
  return run;
}

TEST(JerkLimitedAxis, StepsAreNearlyTimeOptimalAndWithinLimits) {
  for (const double distance : {0.02, 0.25, 1.0, 3.0, 50.0})
    for (const double sign : {1.0, -1.0}) {
      JerkLimitedAxis axis;
      axis.start_from({static_cast<float>(sign * distance), 0, 0});
      const double best = optimal_duration(distance, 1.5, 2.5, 8);
      const Course run = run_to_goal(axis, kLimits, static_cast<int>(1500 * best) + 500);
      EXPECT_EQ(axis.state().to_go, 0) << distance;
      EXPECT_EQ(axis.state().velocity, 0);
      EXPECT_LT(run.steps * 1e-3, 1.02 * best + 0.03) << distance;
      EXPECT_GT(run.steps * 1e-3, best - 0.03) << distance;
      EXPECT_LE(run.most_speed, 1.5F * 1.0001F);
      EXPECT_LE(run.most_acceleration, 2.5F * 1.0001F);
      EXPECT_LE(run.most_jerk, 8 * 1.01F);
      EXPECT_LE(run.overshoot, 2e-4F);
    }
}

TEST(JerkLimitedAxis, StoppingDistanceIsWhereBrakingEnds) {
  Rng rng(1);
  for (int n = 0; n < 300; ++n) {
    const auto v = static_cast<float>(rng.uniform(-1.5, 1.5)), a = static_cast<float>(rng.uniform(-2.5, 2.5));
    const float claimed = stopping_distance(v, a, kLimits);
    JerkLimitedAxis axis;
    axis.start_from({0, v, a});
    for (int i = 0; i < 4000; ++i) axis.step_to_velocity(0, kLimits, kPeriod_s);
    ASSERT_EQ(axis.state().velocity, 0);
    ASSERT_NEAR(-axis.state().to_go, claimed, 0.003F) << v << " " << a;
  }
}

TEST(JerkLimitedAxis, FromAnyStateItReachesItsGoalAndCanAlwaysStop) {
  Rng rng(2);
  for (int n = 0; n < 300; ++n) {
    // Also beyond the limits: a vehicle blown by a gust, or flown by somebody.
    JerkLimitedAxis axis;
    const auto v = static_cast<float>(rng.uniform(-3, 3)), a = static_cast<float>(rng.uniform(-4, 4));
    axis.start_from({static_cast<float>(rng.uniform(-4, 4)), v, a});
    for (int i = 0; i < 15000; ++i) {
      if (i < 5000 && i % 500 == 0) axis.move_goal_by(static_cast<float>(rng.uniform(-2, 2)));
      const float before = axis.state().acceleration;
      axis.step_to_goal(kLimits, kPeriod_s);
      const auto& s = axis.state();
      ASSERT_LE(std::abs(s.acceleration - before), 8 * kPeriod_s * 1.01F + (s.velocity == 0 ? 0.02F : 0));
      ASSERT_LE(std::abs(s.acceleration), std::max(2.5F, std::abs(a)) * 1.001F);
      if (i > 3000) {
        ASSERT_LE(std::abs(s.velocity), 1.5F * 1.001F);
      }
    }
    ASSERT_EQ(axis.state().to_go, 0) << n;
    ASSERT_EQ(axis.state().acceleration, 0);
  }
}

TEST(JerkLimitedAxis, AGoalThatIsNotTooNearIsNotPassed) {
  Rng rng(3);
  for (int n = 0; n < 200; ++n) {
    JerkLimitedAxis axis;
    const auto v = static_cast<float>(rng.uniform(0, 1.5)), a = static_cast<float>(rng.uniform(-2, 2));
    const float stop = stopping_distance(v, a, kLimits);
    if (stop < 0 || settled_velocity(v, a, 8) > 1.5F) continue;
    axis.start_from({stop + static_cast<float>(rng.uniform(0.002, 2)), v, a});
    ASSERT_LE(run_to_goal(axis, kLimits, 6000).overshoot, 2e-4F) << n;
  }
}

TEST(JerkLimitedAxis, VelocityStepsTakeTheClosedFormTime) {
  JerkLimitedAxis axis;
  axis.start_from({});
  int steps = 0;
  while (axis.state().velocity != 1.0F && steps < 3000) {
    axis.step_to_velocity(1, kLimits, kPeriod_s);
    ++steps;
  }
  EXPECT_NEAR(steps * 1e-3, 1.0 / 2.5 + 2.5 / 8, 0.006);  // v/a + a/j
  axis.step_to_velocity(9, kLimits, kPeriod_s);
  for (int i = 0; i < 2000; ++i) axis.step_to_velocity(9, kLimits, kPeriod_s);
  EXPECT_EQ(axis.state().velocity, 1.5F);
}

TEST(JerkLimitedAxis, UnequalSpeedsUpAndDown) {
  const AxisLimits limits{1.0F, 0.4F, 2.5F, 8};
  JerkLimitedAxis axis;
  axis.start_from({3, 0, 0});
  EXPECT_NEAR(run_to_goal(axis, limits, 6000).most_speed, 1, 1e-3F);
  axis.move_goal_by(-3);
  EXPECT_NEAR(run_to_goal(axis, limits, 12000).most_speed, 0.4F, 1e-3F);
  EXPECT_EQ(axis.state().to_go, 0);
}

}  // namespace
}  // namespace hm
