#include "hm/control/position_controller.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

namespace hm {
namespace {

constexpr double kStep_s = 0.001;

/// The controller on a double integrator (a vehicle that has every acceleration at once); applied is what
/// leaves a further limit of the acceleration, if any.
struct PointMass {
  PositionController controller;
  double p = 0, v = 0, disturbance = 0;
  float limit_m_s2 = 100;
  double command = 0;
  explicit PointMass(const PositionParams& params) : controller(params, 0.001F) {}
  void step(double reference, int axis = 0) {
    PositionErrors errors;
    errors.position_m[axis] = static_cast<float>(reference - p);
    errors.velocity_m_s[axis] = static_cast<float>(-v);
    Vec3f force = controller.step(errors, 1.2F);
    const float gravity = axis == 2 ? kGravityF_m_s2 : 0;
    force[axis] = gravity + clamp_f(force[axis] - gravity, -limit_m_s2, limit_m_s2);
    controller.applied(force, true, true);
    command = static_cast<double>(force[axis] - gravity);
    const double a = command + disturbance;
    p += kStep_s * (v + 0.5 * kStep_s * a);
    v += kStep_s * a;
  }
};

PositionParams without_integral() {
  PositionParams params;
  params.integral_xy_per_s2 = params.integral_z_per_s2 = 0;
  params.correction_m_s = 20;
  params.most_thrust_ratio = 10;
  return params;
}

TEST(PositionController, StepOfADoubleIntegratorIsTheAnalyticOne) {
  // s^2 + Kv s + Kv Kp: x: Kv 3, Kp 1.5, a damped oscillation; z: Kv 5, Kp 2 likewise. Compared at every
  // step.
  for (const int axis : {0, 2}) {
    PointMass body(without_integral());
    const double kv = axis == 0 ? 3 : 5, kp = axis == 0 ? 1.5 : 2;
    const std::complex<double> root = std::sqrt(std::complex<double>(kv * kv / 4 - kv * kp));
    const std::complex<double> s1 = -kv / 2 + root, s2 = -kv / 2 - root;
    for (int i = 1; i <= 5000; ++i) {
      body.step(0.5, axis);
      const double t = kStep_s * i;
      const auto rest = (s2 * std::exp(s1 * t) - s1 * std::exp(s2 * t)) / (s2 - s1);
      ASSERT_NEAR(body.p, 0.5 * (1 - rest.real()), 1e-3) << t;
    }
  }
}

TEST(PositionController, IntegralRemovesADisturbance) {
  PositionParams params = without_integral();
  PointMass without(params);
  params.integral_xy_per_s2 = 0.8F;
  PointMass with(params);
  without.disturbance = with.disturbance = -0.9;
  for (int i = 0; i < 30000; ++i) {
    without.step(0);
    with.step(0);
  }
  EXPECT_NEAR(without.p, -0.9 / (3 * 1.5), 1e-3) << "closed form of the offset: d / (Kv Kp)";
  EXPECT_NEAR(with.p, 0, 1e-3);
  EXPECT_NEAR(with.controller.integral_m_s2().x(), 0.9F, 1e-2F);
}

struct Recovery {
  double integral, most, settled_s;
};

/// Held against a wall at -0.3 m for 20 s by a disturbance of which only 60 % can be countered, then free.
Recovery recovery_after_wall(float anti_windup_s, double held_s) {
  PositionParams params;
  params.max_integral_m_s2 = 50;
  params.anti_windup_s = anti_windup_s;
  PointMass body(params);
  body.p = -0.3;
  body.disturbance = -0.5;
  body.limit_m_s2 = 0.3F;
  for (int i = 0; i < 1000 * held_s; ++i) {
    body.step(0);
    body.p = -0.3;
    body.v = 0;
  }
  Recovery recovery{static_cast<double>(body.controller.integral_m_s2().x()), -1, 0};
  body.limit_m_s2 = 100;
  for (int i = 0; i < 20000; ++i) {
    body.step(0);
    recovery.most = std::max(recovery.most, body.p);
    if (std::abs(body.p) > 0.05) recovery.settled_s = 1e-3 * i;
  }
  return recovery;
}

TEST(PositionController, WindupIsBoundedAndRecoveryFast) {
  const Recovery fresh = recovery_after_wall(0.5F, 0), held = recovery_after_wall(0.5F, 20);
  const Recovery open = recovery_after_wall(1e9F, 20);
  EXPECT_LT(std::abs(held.integral), 0.01) << "unloaded, and not driven beyond";
  EXPECT_LT(held.most, 0.02);
  EXPECT_LT(held.settled_s, fresh.settled_s + 0.05);
  EXPECT_NEAR(open.integral, 20 * 0.8 * 0.45, 0.1) << "without back-calculation it winds up";
  EXPECT_GT(open.most, 0.5);
  EXPECT_GT(open.settled_s, held.settled_s + 2);
}

TEST(PositionController, ASetPointStepKicksNoMoreThanItsGain) {
  PositionController controller({}, 0.001F);
  PositionErrors errors;
  const Vec3f before = controller.step(errors, 0.349F);
  errors.position_m.x() = 0.1F;
  const Vec3f first = controller.step(errors, 0.349F), second = controller.step(errors, 0.349F);
  EXPECT_NEAR(first.x() - before.x(), 3 * 1.5F * 0.1F, 1e-5F);
  EXPECT_NEAR(second.x(), first.x(), 1e-5F) << "no spike that is gone a step later";
}

TEST(PositionController, LimitsKeepTheVerticalPartFirst) {
  const Vec3f far = limited_specific_force({30, -40, 12}, 3, 16, 0.349F);
  EXPECT_FLOAT_EQ(far.z(), 12);
  EXPECT_NEAR(norm_f(far.x(), far.y()), 12 * std::tan(0.349F), 1e-4F);
  EXPECT_NEAR(far.x() / far.y(), -0.75F, 1e-6F) << "the direction stays";
  const Vec3f high = limited_specific_force({30, 0, 25}, 3, 16, 0.349F);
  EXPECT_FLOAT_EQ(high.z(), 16);
  EXPECT_NEAR(high.x(), 0, 1e-3F);
  EXPECT_FLOAT_EQ(limited_specific_force({0, 0, -5}, 3, 16, 0.349F).z(), 3);
  for (float x = -20; x <= 20; x += 3.3F)
    for (float z = -10; z < 30; z += 1.7F) {
      const Vec3f f = limited_specific_force({x, 0.5F * x, z}, 3, 16, 0.349F);
      EXPECT_LE(norm_f(f), 16.0001F);
      EXPECT_LE(std::atan2(norm_f(f.x(), f.y()), f.z()), 0.3491F);
      EXPECT_GE(f.z(), 3);
    }
}

TEST(PositionController, OnlyTheAxesThatFollowLearn) {
  PositionController controller({}, 0.001F);
  PositionErrors errors;
  errors.velocity_m_s = {1, 1, 1};
  for (int i = 0; i < 100; ++i) {
    const Vec3f force = controller.step(errors, 0.349F);
    controller.applied(force, false, true);
  }
  EXPECT_EQ(controller.integral_m_s2().x(), 0);
  EXPECT_GT(controller.integral_m_s2().z(), 0.05F);
}

}  // namespace
}  // namespace hm
