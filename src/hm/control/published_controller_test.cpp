#include "hm/control/published_controller.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "hm/control/testing/quadrotor_body.hpp"

namespace hm {
namespace {

constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();
constexpr float kHover = 0.485F;

ControlState state_at(const Vec3f& position, float yaw = 0) {
  ControlState state;
  state.position_m = position;
  state.attitude = attitude_from({0, 0, yaw});
  return state;
}

PublishedCommand published_command_to(const Vec3f& position, float yaw = 0) {
  PublishedCommand command;
  command.goal.position_m = position;
  command.goal.yaw_rad = yaw;
  return command;
}

/// A controller that hovers, past the fading of its start.
PublishedController hovering(const PublishedControlParams& params = {}) {
  PublishedController controller(params);
  controller.start_from({0, 0, 0, kHover});
  for (int i = 0; i < 5000; ++i) controller.step(state_at({0, 0, 0}), published_command_to({0, 0, 0}));
  return controller;
}

TEST(PiD, IsEquation218) {
  PiD law({0.4F, 0.2F, 0.7F, 1, 0.05F, 10, 10}, 0.001F);
  double integral = 0;
  for (int i = 0; i < 3000; ++i) {
    const double t = 1e-3 * i, error = std::sin(t), velocity = -std::cos(t);
    const float output = law.step(static_cast<float>(error), static_cast<float>(velocity));
    ASSERT_NEAR(output, 0.05 + 0.4 * error + 0.2 * integral - 0.7 * velocity, 1e-4) << t;
    law.applied(output);
    integral += 1e-3 * error;
  }
}

TEST(PiD, DampingFallsWithTheErrorWhereTheAuthorsCodeTruncated) {
  // The published C code took the integer abs() of |e| < 1 m, so that (1/d_base)^|e| was always 1.
  const PiD law(PublishedControlParams{}.position_xy, 0.001F);
  EXPECT_NEAR(law.damping(0), 0.7F, 1e-6F);
  EXPECT_NEAR(law.damping(0.3F), 0.7 * std::pow(2.6, -0.3), 1e-6);
  EXPECT_NEAR(law.damping(-0.5F), 0.7 * std::pow(2.6, -0.5), 1e-6);
  PiD stepped(PublishedControlParams{}.position_xy, 0.001F);
  EXPECT_NEAR(stepped.step(0.5F, 1), 0.4 * 0.5 - 0.7 * std::pow(2.6, -0.5), 1e-6);
}

TEST(PiD, StepOfADoubleIntegratorIsTheAnalyticOne) {
  // Without d_base, limits and integral: x'' = g (kp e - kd v), critically damped for these gains
  const double g = 9.80665, kp = 0.4, kd = 2 * std::sqrt(kp / g);
  PiD law({static_cast<float>(kp), 0, static_cast<float>(kd), 1, 0, 0, 100}, 0.001F);
  const double w = std::sqrt(g * kp);
  double x = 0, v = 0;
  for (int i = 1; i <= 4000; ++i) {
    const double a = g * static_cast<double>(law.step(static_cast<float>(1 - x), static_cast<float>(v)));
    x += 1e-3 * (v + 0.5e-3 * a);
    v += 1e-3 * a;
    const double t = 1e-3 * i;
    ASSERT_NEAR(x, 1 - (1 + w * t) * std::exp(-w * t), 2e-3) << t;
  }
}

TEST(PiD, TheIntegralStopsAtLimitsAndItsAuthorityIsKiTimesItsLimit) {
  PiD law({20, 5, 25, 1, 48.5F, 0.25F, 1}, 0.001F);
  for (int i = 0; i < 10000; ++i) law.applied(law.step(0.2F, 0));
  EXPECT_FLOAT_EQ(law.integral(), 0.25F);
  EXPECT_NEAR(law.step(0, 0), 48.5F + 1.25F, 1e-4F);
  PiD saturated({20, 5, 25, 1, 48.5F, 1000, 1}, 0.001F);
  for (int i = 0; i < 10000; ++i) {
    saturated.step(0.5F, 0);
    saturated.applied(50);  // less came through than wanted, for 10 s
  }
  EXPECT_EQ(saturated.integral(), 0) << "5 s m without anti-windup";
  saturated.applied(saturated.step(-0.5F, 0));
  EXPECT_LT(saturated.integral(), 0) << "it still unloads";
}

TEST(PublishedController, ASetPointStepCausesNoDerivativeKick) {
  PublishedControlParams params;
  params.tilt_rad = 0.8F;
  params.pitch_slew_rad_s = 1000;
  PublishedController controller = hovering(params);
  const float before = controller.output().pitch_rad;
  const float first = controller.step(state_at({0, 0, 0}), published_command_to({0.3F, 0, 0})).pitch_rad;
  const float second = controller.step(state_at({0, 0, 0}), published_command_to({0.3F, 0, 0})).pitch_rad;
  EXPECT_NEAR(first - before, 0.4F * 0.3F, 1e-4F);
  EXPECT_NEAR(second, first, 1e-3F);
}

TEST(PublishedController, ErrorsAreOfTheLevelBaseFrame) {
  // At yaw 90 degrees a goal to the north (+y) lies ahead: pitch, not roll.
  PublishedController controller;
  controller.start_from({0, 0, 0, kHover});
  RpytCommand output;
  for (int i = 0; i < 3000; ++i)
    output = controller.step(state_at({0, 0, 0}, kPiF / 2), published_command_to({0, 0.2F, 0}, kPiF / 2));
  EXPECT_GT(output.pitch_rad, 0.05F);
  EXPECT_NEAR(output.roll_rad, 0, 1e-4F);
  PublishedController left;
  left.start_from({0, 0, 0, kHover});
  for (int i = 0; i < 3000; ++i) output = left.step(state_at({0, 0, 0}), published_command_to({0, 0.2F, 0}));
  EXPECT_LT(output.roll_rad, -0.05F) << "to the left by negative roll";
  EXPECT_NEAR(output.pitch_rad, 0, 1e-4F);
}

TEST(PublishedController, EveryOutputHasItsLimitAndSlewLimitInEveryMode) {
  // The published firmware limited the change of the thrust only.
  PublishedControlParams params;
  params.roll_slew_rad_s = 1;
  params.pitch_slew_rad_s = 2;
  params.yaw_slew_rad_s2 = 3;
  params.thrust_slew_percent_s = 50;
  for (const AxisMode mode :
       {AxisMode::kDisabled, AxisMode::kDirect, AxisMode::kPosition, AxisMode::kVelocity}) {
    PublishedController controller(params);
    PublishedCommand command = published_command_to({90, -90, 90}, 3);
    command.modes = {mode, mode, mode, mode};
    command.goal.velocity_m_s = {90, -90, 90};
    command.goal.yaw_rate_rad_s = 90;
    command.direct = command.manual = {2, 2, 90, 2};
    RpytCommand before{};
    for (int i = 0; i < 4000; ++i) {
      const RpytCommand now = controller.step(state_at({0, 0, 0}), command);
      ASSERT_LE(std::abs(now.roll_rad - before.roll_rad), 1.001e-3F);
      ASSERT_LE(std::abs(now.pitch_rad - before.pitch_rad), 2.001e-3F);
      ASSERT_LE(std::abs(now.yaw_rate_rad_s - before.yaw_rate_rad_s), 3.001e-3F);
      ASSERT_LE(std::abs(now.thrust_ratio - before.thrust_ratio), 0.5001e-3F);
      before = now;
    }
    EXPECT_NEAR(before.roll_rad, 0.15F, 1e-5F) << static_cast<int>(mode);
    EXPECT_NEAR(before.pitch_rad, 0.15F, 1e-5F);
    EXPECT_NEAR(before.yaw_rate_rad_s, 1, 1e-5F);
    EXPECT_NEAR(before.thrust_ratio,
                mode == AxisMode::kVelocity || mode == AxisMode::kPosition ? 0.69F : 0.7F, 0.02F);
  }
}

TEST(PublishedController, ModesAreOfEachAxis) {
  PublishedController controller = hovering();
  PublishedCommand command = published_command_to({0.2F, 0, 0});
  command.modes = {AxisMode::kPosition, AxisMode::kDirect, AxisMode::kDisabled, AxisMode::kVelocity};
  command.direct = {0.11F, 9, 9, 9};
  command.manual = {9, 9, 9, 0.4F};
  command.goal.yaw_rate_rad_s = 0.25F;
  RpytCommand output;
  for (int i = 0; i < 3000; ++i) output = controller.step(state_at({0, 0, 0}), command);
  EXPECT_GT(output.pitch_rad, 0.07F);
  EXPECT_FLOAT_EQ(output.roll_rad, 0.11F);
  EXPECT_FLOAT_EQ(output.thrust_ratio, 0.4F);
  EXPECT_FLOAT_EQ(output.yaw_rate_rad_s, 0.25F) << "yaw velocity passes through";
  EXPECT_EQ(published_velocity_modes().z, AxisMode::kPosition);
  EXPECT_EQ(published_velocity_modes().x, AxisMode::kVelocity);
}

TEST(PublishedController, ChangesOfModeContinueFromTheOutputInForce) {
  PublishedControlParams params;  // slew limits that would hide nothing
  params.roll_slew_rad_s = params.pitch_slew_rad_s = params.yaw_slew_rad_s2 = 1000;
  params.thrust_slew_percent_s = 10000;
  PublishedController controller = hovering(params);
  PublishedCommand command = published_command_to({0.4F, -0.4F, 0.5F}, 0.5F);
  command.direct = {0.12F, -0.1F, -0.6F, 0.55F};
  const auto all = [](AxisMode mode) { return PublishedModes{mode, mode, mode, mode}; };
  for (const AxisMode from : {AxisMode::kDirect, AxisMode::kPosition, AxisMode::kVelocity})
    for (const AxisMode to : {AxisMode::kPosition, AxisMode::kVelocity}) {
      if (from == to) continue;
      command.modes = all(from);
      for (int i = 0; i < 3000; ++i) controller.step(state_at({0, 0, 0}), command);
      const RpytCommand before = controller.output();
      command.modes = all(to);
      const RpytCommand after = controller.step(state_at({0, 0, 0}), command);
      EXPECT_NEAR(after.roll_rad, before.roll_rad, 1e-4F);
      EXPECT_NEAR(after.pitch_rad, before.pitch_rad, 1e-4F);
      EXPECT_NEAR(after.thrust_ratio, before.thrust_ratio, 1e-4F);
      if (to == AxisMode::kPosition) {
        EXPECT_NEAR(after.yaw_rate_rad_s, before.yaw_rate_rad_s, 1e-4F);
      }
    }
}

TEST(PublishedController, YawIsPiAsInTheTextAndTheLaunchedGainsAreP) {
  // Dissertation 2.3.2 says PI; the launch file sets ki to 0. A gyro that is off by 0.1 rad/s shows the
  // difference.
  const auto offset = [](float ki) {
    PublishedControlParams params;
    params.yaw.ki = ki;
    PublishedController controller = hovering(params);
    double yaw = 0;
    for (int i = 0; i < 60000; ++i) {
      const ControlState state = state_at({0, 0, 0}, static_cast<float>(yaw));
      yaw +=
          1e-3 *
          (static_cast<double>(controller.step(state, published_command_to({0, 0, 0})).yaw_rate_rad_s) + 0.1);
    }
    return yaw;
  };
  EXPECT_NEAR(offset(0), 0.1 / 1.2, 1e-3);
  EXPECT_NEAR(offset(0.3F), 0, 1e-3);
}

TEST(PublishedController, YawErrorsAreWrapped) {
  PublishedController controller;
  RpytCommand output;
  for (int i = 0; i < 2000; ++i)
    output = controller.step(state_at({0, 0, 0}, 3.1F), published_command_to({0, 0, 0}, -3.1F));
  EXPECT_NEAR(output.yaw_rate_rad_s, 1.2F * (2 * kPiF - 6.2F), 1e-3F);
}

TEST(PublishedController, WhatIsNoNumberChangesNothing) {
  PublishedController controller = hovering();
  const RpytCommand before = controller.output();
  ControlState state = state_at({kNoNumber, 0, 0});
  controller.step(state, published_command_to({0.5F, 0, 0}));
  state = state_at({0, 0, 0});
  state.attitude = {0, 0, 0, 0};
  controller.step(state, published_command_to({0.5F, 0, 0}));
  controller.step(state_at({0, 0, 0}), published_command_to({0, kNoNumber, 0}));
  controller.start_from({0, kNoNumber, 0, 0});
  EXPECT_EQ(controller.bad_inputs(), 4U);
  EXPECT_EQ(controller.output().pitch_rad, before.pitch_rad);
  EXPECT_EQ(controller.output().thrust_ratio, before.thrust_ratio);
  EXPECT_NEAR(controller.step(state_at({0, 0, 0}), published_command_to({0, 0, 0})).thrust_ratio,
              before.thrust_ratio, 1e-4F);
}

TEST(PublishedController, HoversTheVehicleItWasMadeFor) {
  QuadrotorBodySettings settings;
  settings.inner = QuadrotorBodySettings::InnerLoop::kSecondOrder;
  QuadrotorBody body(settings);
  PublishedController controller;
  controller.start_from({0, 0, 0, kHover});
  body.position = {0.3, -0.2, 0.1};
  CascadeOutput output;
  double late = 0;
  for (int i = 0; i < 40000; ++i) {
    output.rpyt = controller.step(body.seen(), published_command_to({0, 0, 0}));
    body.step(output);
    if (i > 30000) late = std::max(late, body.position.norm());
  }
  EXPECT_LT(late, 0.05);
}

}  // namespace
}  // namespace hm
