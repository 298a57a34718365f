#include "hm/sim/vehicle/inner_loop.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "hm/sim/vehicle/quadrotor_dynamics.hpp"

namespace hm {
namespace {

/// Pitch angle at a time after a command, of a vehicle whose rotors all turn; yaw 2 rad throughout.
double pitch_after(InnerLoopKind kind, double command_rad, double time_s, double rotor_share = 1) {
  VehicleParams params;
  params.make_perfect();
  params.inner_loop.inner_loop = kind;
  const QuadrotorDynamics dynamics(params, Vec3(0.005, 0, 0));
  QuadrotorState state = dynamics.at_rest(SE3(so3_exp({0, 0, 2}), Vec3::Zero()));
  state.rotor_speed_rad_s.setConstant(rotor_share * params.hover_speed_rad_s());
  QuadrotorInputs inputs;
  inputs.rotor_command_rad_s = state.rotor_speed_rad_s;
  inputs.attitude.pitch_rad = command_rad;
  for (int i = 0; i < std::lround(time_s / 1e-3); ++i) state = dynamics.advance(state, inputs, 1e-3);
  return std::asin(-state.R_world_base()(2, 0));
}

TEST(InnerLoop, SecondOrderFollowsItsClosedForm) {
  const double w0 = 12, zeta = 0.8, command = 0.35;
  const double root = std::sqrt(1 - zeta * zeta);
  for (const double t : {0.05, 0.1, 0.2, 0.3, 0.6}) {
    const double decay = std::exp(-zeta * w0 * t), turn = root * w0 * t;
    const double share = 1 - decay * (std::cos(turn) + zeta / root * std::sin(turn));
    EXPECT_NEAR(pitch_after(InnerLoopKind::kSecondOrder, command, t), command * share, 1e-7);
  }
}

TEST(InnerLoop, FirstOrderReachesItsGainWithItsTimeConstant) {
  const double command = 0.3, final = 0.75 * command;
  EXPECT_NEAR(pitch_after(InnerLoopKind::kFirstOrder, command, 3), final, 1e-5);
  EXPECT_NEAR(pitch_after(InnerLoopKind::kFirstOrder, command, 0.257), final * (1 - std::exp(-1)),
              0.02 * final);
}

TEST(InnerLoop, YawRateFollowsItsCommand) {
  InnerLoopParams params;
  params.inner_loop = InnerLoopKind::kSecondOrder;
  InnerLoopCommand command;
  command.yaw_rate_rad_s = 0.8;
  const Vec3 a = inner_loop_acceleration(params, command, so3_exp({0, 0, -2}), Vec3(0, 0, 0.3));
  EXPECT_LT((a - Vec3(0, 0, 5)).norm(), 1e-9);
}

TEST(InnerLoop, RollAndPitchAreAnglesOfTheWorld) {
  InnerLoopParams params;
  params.inner_loop = InnerLoopKind::kSecondOrder;
  InnerLoopCommand command;
  command.roll_rad = 0.2;
  command.pitch_rad = -0.1;
  const Mat3 reached = so3_exp({0, 0, 1.1}) * so3_exp({0, -0.1, 0}) * so3_exp({0.2, 0, 0});
  EXPECT_LT(inner_loop_acceleration(params, command, reached, Vec3::Zero()).norm(), 1e-9);
}

TEST(InnerLoop, LimitsItsCommands) {
  EXPECT_NEAR(pitch_after(InnerLoopKind::kSecondOrder, 1e300, 2), 1.2, 1e-6);
  InnerLoopParams params;
  params.inner_loop = InnerLoopKind::kFirstOrder;
  InnerLoopCommand command;
  command.yaw_rate_rad_s = -1e300;
  EXPECT_NEAR(inner_loop_acceleration(params, command, Mat3::Identity(), Vec3::Zero()).z(), -100, 1e-9);
}

TEST(InnerLoop, HasNoEffectWithRotorsAtRest) {
  EXPECT_NEAR(pitch_after(InnerLoopKind::kSecondOrder, 0.3, 1, 0), 0, 1e-12);
  EXPECT_GT(pitch_after(InnerLoopKind::kSecondOrder, 0.3, 1, 0.6), 0.29);
}

}  // namespace
}  // namespace hm
