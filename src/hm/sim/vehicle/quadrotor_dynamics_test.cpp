#include "hm/sim/vehicle/quadrotor_dynamics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "hm/sensors/imu.hpp"

namespace hm {
namespace {

constexpr double kH = 1e-3;

VehicleParams still_air() {
  VehicleParams params;
  params.make_perfect();
  return params;
}

QuadrotorState after(const QuadrotorDynamics& dynamics, QuadrotorState state, const QuadrotorInputs& inputs,
                     double time_s, double step_s = kH) {
  for (int i = 0; i < std::lround(time_s / step_s); ++i) state = dynamics.advance(state, inputs, step_s);
  return state;
}

TEST(QuadrotorDynamics, FallWithDragFollowsTheHyperbolicTangent) {
  const VehicleParams params = still_air();
  const QuadrotorDynamics dynamics(params, Vec3::Zero());
  const QuadrotorState start = dynamics.at_rest({});
  const double terminal =
      std::sqrt(params.airframe.mass_kg * kGravity_m_s2 / params.airframe.body_drag_n_s2_m2);
  for (const double t : {0.5, 2.0, 6.0}) {
    const QuadrotorState state = after(dynamics, start, {}, t);
    const double u = kGravity_m_s2 * t / terminal;
    EXPECT_NEAR(state.com_velocity_world_m_s.z(), -terminal * std::tanh(u), 1e-9);
    EXPECT_NEAR(state.com_world_m.z(), -terminal * terminal / kGravity_m_s2 * std::log(std::cosh(u)), 1e-9);
  }
}

TEST(QuadrotorDynamics, WindCarriesAFallingBodyAlong) {
  const QuadrotorDynamics dynamics(still_air(), Vec3::Zero());
  QuadrotorInputs inputs;
  inputs.wind_world_m_s = Vec3(2, -1, 0);
  const QuadrotorState state = after(dynamics, dynamics.at_rest({}), inputs, 30);
  EXPECT_NEAR(state.com_velocity_world_m_s.x(), 2, 1e-3);
  EXPECT_NEAR(state.com_velocity_world_m_s.y(), -1, 1e-3);
}

TEST(QuadrotorDynamics, FreeSymmetricTopPrecesses) {
  const VehicleParams params = still_air();
  const QuadrotorDynamics dynamics(params, Vec3::Zero());
  QuadrotorState state = dynamics.at_rest({});
  state.angular_velocity_base_rad_s = Vec3(1, 0, 5);
  const double j1 = params.airframe.inertia_xy_kg_m2, j3 = params.airframe.inertia_z_kg_m2;
  const Vec3 momentum(j1 * 1, 0, j3 * 5);  // in the world, where it is constant
  const double in_body = (j3 - j1) / j1 * 5, t = 4;
  state = after(dynamics, state, {}, t);
  const Vec3& w = state.angular_velocity_base_rad_s;
  EXPECT_LT((w - Vec3(std::cos(in_body * t), std::sin(in_body * t), 5)).norm(), 1e-8);
  const Vec3 axis = so3_exp(momentum / j1 * t).col(2);  // the axis turns about the momentum at |L| / J1
  EXPECT_LT((state.R_world_base().col(2) - axis).norm(), 1e-8);
  const Vec3 inertia(j1, j1, j3);
  EXPECT_LT((state.R_world_base() * inertia.cwiseProduct(w) - momentum).norm(), 1e-9);
}

TEST(QuadrotorDynamics, HoversAt583RadiansPerSecondAnd48PercentThrust) {
  const VehicleParams params = still_air();
  const double hover = params.hover_speed_rad_s();
  EXPECT_NEAR(hover, 583.5, 0.05);
  EXPECT_NEAR(std::pow(hover / params.rotor.max_speed_rad_s, 2), 0.485, 5e-4);
  const QuadrotorDynamics dynamics(params, Vec3::Zero());
  QuadrotorState state = dynamics.at_rest(SE3(so3_exp({0, 0, 0.7}), Vec3(1, 2, 3)));
  state.rotor_speed_rad_s.setConstant(hover);
  QuadrotorInputs inputs;
  inputs.rotor_command_rad_s.setConstant(hover);
  const QuadrotorRates rates = dynamics.rates(state, inputs);
  EXPECT_LT(rates.acceleration_world_m_s2.norm(), 1e-12);
  EXPECT_LT(rates.angular_acceleration_base_rad_s2.norm(), 1e-12);
  const double torque = params.rotor.torque_ratio_m * params.airframe.mass_kg * kGravity_m_s2;
  EXPECT_NEAR(dynamics.rotor_power_w(state, inputs), torque * hover, 1e-9);
}

TEST(QuadrotorDynamics, OffsetCentreOfMassTiltsAHoveringVehicle) {
  const VehicleParams params = still_air();
  const Vec3 com(0.005, 0, 0);
  const QuadrotorDynamics dynamics(params, com);
  QuadrotorState state = dynamics.at_rest({});
  EXPECT_EQ(state.com_world_m, com);
  state.rotor_speed_rad_s.setConstant(params.hover_speed_rad_s());
  const QuadrotorRates rates = dynamics.rates(state, {});
  const double weight = params.airframe.mass_kg * kGravity_m_s2;
  EXPECT_NEAR(rates.angular_acceleration_base_rad_s2.y(), 0.005 * weight / 0.01, 1e-9);  // nose down
  const FlightState base = dynamics.base_motion(state, rates);
  EXPECT_LT(base.T_world_base.translation().norm(), 1e-15);
  EXPECT_NEAR(base.acceleration_world_m_s2.z(), 0.005 * 0.005 * weight / 0.01, 1e-9);
}

TEST(QuadrotorDynamics, MotorReaches63PercentAfterItsTimeConstant) {
  const QuadrotorDynamics dynamics(still_air(), Vec3::Zero());
  QuadrotorInputs inputs;
  inputs.rotor_command_rad_s.setConstant(500);
  const QuadrotorState up = after(dynamics, dynamics.at_rest({}), inputs, 0.0125, 1.25e-3);
  EXPECT_NEAR(up.rotor_speed_rad_s[1] / 500, 1 - std::exp(-1), 1e-5);
  QuadrotorState fast = dynamics.at_rest({});
  fast.rotor_speed_rad_s.setConstant(500);
  const QuadrotorState down = after(dynamics, fast, {}, 0.025);
  EXPECT_NEAR(down.rotor_speed_rad_s[1] / 500, std::exp(-1), 1e-5);
}

TEST(QuadrotorDynamics, EnergyIsConservedWithoutDrag) {
  VehicleParams params = still_air();
  params.airframe.body_drag_n_s2_m2 = 0;
  const QuadrotorDynamics dynamics(params, Vec3(0.004, -0.003, 0));
  QuadrotorState state = dynamics.at_rest({});
  state.com_velocity_world_m_s = Vec3(4, 1, 6);
  state.angular_velocity_base_rad_s = Vec3(3, -8, 12);
  const auto energy = [&](const QuadrotorState& s) {
    const Vec3& w = s.angular_velocity_base_rad_s;
    const double turning = 0.5 * (0.01 * (w.x() * w.x() + w.y() * w.y()) + 0.02 * w.z() * w.z());
    return turning + params.airframe.mass_kg *
                         (0.5 * s.com_velocity_world_m_s.squaredNorm() + kGravity_m_s2 * s.com_world_m.z());
  };
  const double before = energy(state);
  for (int i = 0; i < 10; ++i) {
    state = after(dynamics, state, {}, 1);
    EXPECT_NEAR(energy(state) / before, 1, 1e-6);
  }
}

TEST(QuadrotorDynamics, ErrorFallsWithTheFourthPowerOfTheStep) {
  VehicleParams params = still_air();
  const QuadrotorDynamics dynamics(params, Vec3(0.005, 0, 0));
  QuadrotorState start = dynamics.at_rest({});
  start.com_velocity_world_m_s = Vec3(3, -1, 0.5);
  start.angular_velocity_base_rad_s = Vec3(2, 1, -3);
  start.rotor_speed_rad_s.setConstant(300);
  QuadrotorInputs inputs;
  inputs.rotor_command_rad_s = RotorValues(600, 590, 610, 580);
  inputs.wind_world_m_s = Vec3(0.5, 1, 0);
  const auto error = [&](double step_s) {
    const QuadrotorState fine = after(dynamics, start, inputs, 0.4, 1e-4);
    const QuadrotorState coarse = after(dynamics, start, inputs, 0.4, step_s);
    return (coarse.com_world_m - fine.com_world_m).norm() +
           (coarse.q_world_base.coeffs() - fine.q_world_base.coeffs()).norm();
  };
  const double order = std::log2(error(4e-3) / error(2e-3));
  EXPECT_GT(order, 3.7);
  EXPECT_LT(order, 4.5);
  EXPECT_LT(error(kH), 1e-7);
}

TEST(QuadrotorDynamics, ThrustGrowsOverAFloor) {
  const VehicleParams params = still_air();
  const QuadrotorDynamics dynamics(params, Vec3::Zero());
  const double height = params.rotor.kRadius_m - params.airframe.kRotorHeight_m;  // rotors at z = R
  QuadrotorState state = dynamics.at_rest(SE3(Mat3::Identity(), Vec3(0, 0, height)));
  state.rotor_speed_rad_s.setConstant(params.hover_speed_rad_s());
  QuadrotorInputs inputs;
  for (RotorSurfaces& s : inputs.surfaces) s.below = SurfacePlane{};
  EXPECT_NEAR(dynamics.rates(state, inputs).acceleration_world_m_s2.z(), kGravity_m_s2 / 15, 1e-9);
}

TEST(QuadrotorDynamics, RotorDragActsAcrossTheAxisOnly) {
  VehicleParams params = still_air();
  params.airframe.body_drag_n_s2_m2 = 0;
  const QuadrotorDynamics dynamics(params, Vec3::Zero());
  QuadrotorState state = dynamics.at_rest({});
  state.rotor_speed_rad_s.setConstant(params.hover_speed_rad_s());
  state.com_velocity_world_m_s = Vec3(1.5, 0, 2);
  const double drag = params.rotor.kDragConstant_n_s2_m * 4 * params.hover_speed_rad_s() * 1.5;
  const Vec3 a = dynamics.rates(state, {}).acceleration_world_m_s2;
  EXPECT_LT((a - Vec3(-drag / params.airframe.mass_kg, 0, 0)).norm(), 1e-12);
}

TEST(QuadrotorDynamics, RotorDragDampsTheYawRate) {
  const VehicleParams params = still_air();
  const QuadrotorDynamics dynamics(params, Vec3::Zero());
  QuadrotorState state = dynamics.at_rest({});
  state.rotor_speed_rad_s.setConstant(params.hover_speed_rad_s());
  state.angular_velocity_base_rad_s.z() = 3;
  const double arm2 = params.airframe.arm_m * params.airframe.arm_m;
  const double torque = -params.rotor.kDragConstant_n_s2_m * 4 * params.hover_speed_rad_s() * arm2 * 3;
  const Vec3 dw = dynamics.rates(state, {}).angular_acceleration_base_rad_s2;
  EXPECT_LT((dw - Vec3(0, 0, torque / params.airframe.inertia_z_kg_m2)).norm(), 1e-12);
}

TEST(QuadrotorDynamics, MotionOfTheBaseIsThatOfARigidBody) {
  const QuadrotorDynamics dynamics(still_air(), Vec3(0.004, -0.003, 0.02));
  QuadrotorState state = dynamics.at_rest(SE3(so3_exp({0.2, -0.3, 1}), Vec3(1, 2, 3)));
  state.com_velocity_world_m_s = Vec3(1, -2, 0.5);
  state.angular_velocity_base_rad_s = Vec3(2, -1, 3);
  state.rotor_speed_rad_s = RotorValues(500, 520, 540, 560);
  QuadrotorInputs inputs;
  inputs.rotor_command_rad_s = state.rotor_speed_rad_s;
  constexpr double kApart_s = 1e-4;
  const auto motion = [&](const QuadrotorState& s) {
    return dynamics.base_motion(s, dynamics.rates(s, inputs));
  };
  const QuadrotorState next = dynamics.advance(state, inputs, kApart_s);
  const FlightState a = motion(state), b = motion(next), c = motion(dynamics.advance(next, inputs, kApart_s));
  const Vec3 moved = c.T_world_base.translation() - a.T_world_base.translation();
  EXPECT_LT((moved / (2 * kApart_s) - b.velocity_world_m_s).norm(), 1e-6);
  const Vec3 faster = c.velocity_world_m_s - a.velocity_world_m_s;
  EXPECT_LT((faster / (2 * kApart_s) - b.acceleration_world_m_s2).norm(), 1e-5);
  const Mat3 turn = a.T_world_base.rotation().transpose() * c.T_world_base.rotation();
  EXPECT_LT((so3_log(turn) / (2 * kApart_s) - b.angular_velocity_base_rad_s).norm(), 1e-5);
  const Vec3 spun = c.angular_velocity_base_rad_s - a.angular_velocity_base_rad_s;
  EXPECT_LT((spun / (2 * kApart_s) - b.angular_acceleration_base_rad_s2).norm(), 1e-4);
}

}  // namespace
}  // namespace hm
