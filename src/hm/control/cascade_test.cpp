#include "hm/control/cascade.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "hm/control/testing/quadrotor_body.hpp"
#include "hm/core/params.hpp"
#include "hm/core/rng.hpp"
#include "hm/core/testing/drawn_vector.hpp"

namespace hm {
namespace {

using Inner = QuadrotorBodySettings::InnerLoop;
constexpr FlightModes kAllPosition{AxisMode::kPosition, AxisMode::kPosition, AxisMode::kPosition};
constexpr FlightModes kAllVelocity{AxisMode::kVelocity, AxisMode::kVelocity, AxisMode::kVelocity};
constexpr FlightModes kAllDirect{AxisMode::kDirect, AxisMode::kDirect, AxisMode::kDirect};
constexpr RpytCommand kHovering{0, 0, 0, 0.4849F};
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

CascadeCommand go_to(const Vec3f& position, float yaw = 0) {
  CascadeCommand command;
  command.modes = kAllPosition;
  command.goal.position_m = position;
  command.goal.yaw_rad = yaw;
  return command;
}

/// Parameters for the inner loop of a body.
CascadeParams params_for(Inner inner) {
  CascadeParams params;
  if (inner == Inner::kRotors) return params;
  params.output = CascadeOutputKind::kAttitudeThrust;
  params.thrust_response_s = 0.05F;
  params.tilt_response_s = inner == Inner::kSecondOrder ? 0.133F : 0.257F;
  if (inner == Inner::kFirstOrder) params.tilt_gain_ratio = 0.75F;
  return params;
}

/// A body that hovers at the origin under a cascade which has learned its mass.
struct Flight {
  QuadrotorBody body;
  Cascade cascade;
  explicit Flight(const QuadrotorBodySettings& settings = {}, const CascadeParams& params = {})
      : body(settings), cascade(params, QuadrotorModel{}) {
    cascade.start_from(body.seen(), kHovering);
    run(4000, go_to({0, 0, 0}));
  }
  const CascadeOutput& step(const CascadeCommand& command) {
    const CascadeOutput& output = cascade.step(body.seen(), command);
    body.step(output);
    return output;
  }
  void run(int steps, const CascadeCommand& command) {
    for (int i = 0; i < steps; ++i) step(command);
  }
};

struct StepResponse {
  double settled_s = 0, overshoot = 0, farthest_s = 0, late = 0;
};

/// A set-point step of 1 m along an axis.
StepResponse step_response(Flight& flight, int axis) {
  Vec3f to(0, 0, 0);
  to[axis] = 1;
  StepResponse response;
  for (int i = 0; i < 6000; ++i) {
    flight.step(go_to(to));
    const double position = flight.body.position[axis];
    response.overshoot = std::max(response.overshoot, position - 1);
    if (std::abs(position - 1) > 0.05) response.settled_s = 1e-3 * i;
    if (i > 5000) response.late = std::max(response.late, (flight.body.position - to.cast<double>()).norm());
  }
  return response;
}

TEST(Cascade, AnAttitudeStepOf20DegreesTakes80Milliseconds) {
  for (const bool pitch : {false, true}) {
    Flight flight;
    CascadeCommand command;
    command.modes = kAllDirect;
    command.direct = kHovering;
    (pitch ? command.direct.pitch_rad : command.direct.roll_rad) = 0.349F;
    int from_10 = -1, to_90 = -1;
    double most = 0;
    for (int i = 0; i < 1000; ++i) {
      flight.step(command);
      const double share = (pitch ? flight.body.pitch() : flight.body.roll()) / 0.349;
      if (from_10 < 0 && share > 0.1) from_10 = i;
      if (to_90 < 0 && share > 0.9) to_90 = i;
      most = std::max(most, share);
    }
    EXPECT_LE(to_90 - from_10, 80) << "bar of issue 14: 120 ms, aim 80";
    EXPECT_GT(from_10, 5) << "the rotors have a lag";
    EXPECT_LT(most, 1.05);
  }
}

TEST(Cascade, AStepOfOneMetreSettlesInTwoSeconds) {
  for (const int axis : {0, 1, 2}) {
    Flight flight;
    const StepResponse response = step_response(flight, axis);
    EXPECT_LT(response.settled_s, axis == 2 ? 2.2 : 1.6) << "bar of issue 14: 3 s, aim 2.2";
    EXPECT_LT(response.overshoot, 0.02) << "bar 10 %, aim 5 %";
    EXPECT_LT(response.late, 0.002);
  }
}

TEST(Cascade, StaysStableWithOtherMassesMotorsAndDelays) {
  for (const double mass : {0.8, 1.2})
    for (const double motor_s : {0.0125, 0.05})
      for (const int delay_ms : {0, 80}) {
        QuadrotorBodySettings settings;
        settings.mass_kg *= mass;
        settings.spin_up_s = motor_s;
        settings.spin_down_s = std::max(0.025, motor_s);
        settings.delay_steps = delay_ms;
        Flight flight(settings);
        const StepResponse response = step_response(flight, 0);
        EXPECT_LT(response.settled_s, 3) << mass << " " << motor_s << " " << delay_ms;
        EXPECT_LT(response.overshoot, 0.1);
        EXPECT_LT(response.late, 0.01);
        EXPECT_NEAR(flight.cascade.output().hover_thrust_ratio, 0.485 * mass, 0.01) << "the mass was learned";
      }
}

TEST(Cascade, FliesVehiclesWithAnInnerLoopOfTheirOwn) {
  for (const Inner inner : {Inner::kSecondOrder, Inner::kFirstOrder})
    for (const int delay_ms : {0, 80}) {
      QuadrotorBodySettings settings;
      settings.inner = inner;
      settings.delay_steps = delay_ms;
      Flight flight(settings, params_for(inner));
      const StepResponse response = step_response(flight, 0);
      EXPECT_LT(response.settled_s, delay_ms ? 5 : 3) << static_cast<int>(inner) << " " << delay_ms;
      EXPECT_LT(response.overshoot, delay_ms ? 0.15 : 0.05);
      EXPECT_LT(response.late, delay_ms ? 0.06 : 0.01);
    }
}

TEST(Cascade, UnequalRotorsAndWindLeaveNoOffset) {
  QuadrotorBodySettings settings;
  settings.rotor_factor = {1.03, 0.97, 1.0, 1.03};
  settings.thrust_factor = 0.9;
  Flight flight(settings);
  flight.body.push_m_s2 = {0.3, -0.2, 0};
  flight.run(15000, go_to({0, 0, 0}, 0.5F));
  EXPECT_LT(flight.body.position.norm(), 0.01);
  EXPECT_NEAR(flight.body.yaw(), 0.5, 0.01);
}

TEST(Cascade, APushBeyondItsLimitsEndsInAFastReturn) {
  // 5 m/s^2 for 3 s is more than 20 degrees of tilt can hold; then calm.
  Flight flight;
  flight.body.push_m_s2 = {5, 0, 0};
  flight.run(3000, go_to({0, 0, 0}));
  EXPECT_GT(flight.body.position.x(), 2);
  EXPECT_LE(std::abs(flight.cascade.integral_m_s2().x()), 2.5F);
  flight.body.push_m_s2.setZero();
  double back = 0, passed = 0, tilt = 0, lowest = 0;
  for (int i = 0; i < 20000; ++i) {
    flight.step(go_to({0, 0, 0}));
    if (flight.body.position.norm() > 0.1) back = 1e-3 * i;
    passed = std::min(passed, flight.body.position.x());
    lowest = std::min(lowest, flight.body.position.z());
    tilt = std::max(tilt, flight.body.tilt());
  }
  EXPECT_LT(back, 14);
  EXPECT_GT(passed, -0.5);
  EXPECT_GT(lowest, -0.1) << "height comes before position";
  EXPECT_LT(tilt, 0.349 * 1.15) << "20 degrees, and what the loop overshoots";
}

TEST(Cascade, ModesChangeWithoutAJumpOfAnyOutput) {
  // At every change while the vehicle moves, the command differs from the last by what the next step of the
  // same mode could differ.
  Flight flight;
  CascadeCommand command = go_to({1, -1, 0.5F}, 0.6F);
  command.goal.velocity_m_s = {-0.6F, 0.3F, 0.2F};
  command.goal.yaw_rate_rad_s = -0.3F;
  command.direct = {0.1F, -0.08F, 0.2F, 0.51F};
  Rng rng(3);
  for (int change = 0; change < 60; ++change) {
    const FlightModes before = command.modes;
    const FlightModes choices[] = {kAllPosition, kAllVelocity, kAllDirect};
    command.modes = choices[rng.below(3)];
    const RpytCommand last = flight.cascade.output().rpyt;
    const CascadeOutput now = flight.step(command);
    if (command.modes != kAllDirect && before != command.modes) {
      EXPECT_NEAR(now.rpyt.roll_rad, last.roll_rad, 0.004F) << change;
      EXPECT_NEAR(now.rpyt.pitch_rad, last.pitch_rad, 0.004F) << change;
      EXPECT_NEAR(now.rpyt.thrust_ratio, last.thrust_ratio, 0.004F) << change;
      EXPECT_NEAR(now.rpyt.yaw_rate_rad_s, last.yaw_rate_rad_s, 0.021F) << change;
    }
    flight.run(200 + static_cast<int>(rng.below(800)), command);
  }
}

TEST(Cascade, ContinuesWhatAnotherControllerCommands) {
  const RpytCommand others{0.05F, -0.07F, 0.1F, 0.5F};
  QuadrotorBody body;
  Cascade cascade({}, QuadrotorModel{});
  ControlState state = body.seen();
  state.attitude = attitude_from({others.roll_rad, others.pitch_rad, 0.4F});
  state.velocity_m_s = {0.4F, -0.3F, 0.1F};
  cascade.start_from(state, others);
  const CascadeOutput& output = cascade.step(state, go_to({0, 0, 0}, 0.4F));
  EXPECT_NEAR(output.rpyt.roll_rad, others.roll_rad, 0.003F);
  EXPECT_NEAR(output.rpyt.pitch_rad, others.pitch_rad, 0.003F);
  EXPECT_NEAR(output.rpyt.thrust_ratio, others.thrust_ratio, 0.003F);
  EXPECT_NEAR(output.rpyt.yaw_rate_rad_s, others.yaw_rate_rad_s, 0.021F);
}

TEST(Cascade, EveryOutputHasItsLimitAndSlewLimit) {
  CascadeParams params;
  params.tilt_slew_rad_s = 3;
  params.thrust_slew_per_s = 1;
  params.yaw_slew_rad_s2 = 4;
  params.rotor_slew_rad_s2 = 5000;
  Flight flight({}, params);
  Rng rng(7);
  CascadeCommand command;
  CascadeOutput before = flight.cascade.output();
  for (int i = 0; i < 20000; ++i) {
    if (i % 250 == 0) {
      const FlightModes choices[] = {kAllPosition, kAllVelocity, kAllDirect};
      command.modes = choices[rng.below(3)];
      const auto wild = [&](double most) { return static_cast<float>(rng.uniform(-most, most)); };
      command.goal = {{wild(50), wild(50), wild(50)}, {wild(9), wild(9), wild(9)}, wild(3), wild(9)};
      command.direct = {wild(2), wild(2), wild(9), wild(2)};
    }
    const CascadeOutput now = flight.step(command);
    ASSERT_LE(norm_f(now.rpyt.roll_rad, now.rpyt.pitch_rad), 0.349F * 1.05F);
    ASSERT_LE(std::abs(now.rpyt.yaw_rate_rad_s), 2.0001F);
    ASSERT_TRUE(now.rpyt.thrust_ratio >= 0 && now.rpyt.thrust_ratio <= 1);
    ASSERT_LE(std::abs(now.rpyt.roll_rad - before.rpyt.roll_rad), 3.001e-3F);
    ASSERT_LE(std::abs(now.rpyt.pitch_rad - before.rpyt.pitch_rad), 3.001e-3F);
    ASSERT_LE(std::abs(now.rpyt.yaw_rate_rad_s - before.rpyt.yaw_rate_rad_s), 4.001e-3F);
    ASSERT_LE(std::abs(now.rpyt.thrust_ratio - before.rpyt.thrust_ratio), 1.001e-3F);
    for (std::size_t r = 0; r < 4; ++r) {
      ASSERT_TRUE(now.rotor_speed_rad_s[r] >= 119.9F && now.rotor_speed_rad_s[r] <= 838.1F);
      ASSERT_LE(std::abs(now.rotor_speed_rad_s[r] - before.rotor_speed_rad_s[r]), 5.001F);
    }
    before = now;
  }
}

TEST(Cascade, VelocityIsFollowedAndPositionHeldAfterwards) {
  Flight flight;
  CascadeCommand command;
  command.modes = kAllVelocity;
  command.goal.velocity_m_s = {0.8F, -0.4F, 0.2F};
  command.goal.yaw_rate_rad_s = 0.4F;
  flight.run(6000, command);
  EXPECT_LT((flight.body.velocity - Eigen::Vector3d(0.8, -0.4, 0.2)).norm(), 0.02);
  EXPECT_NEAR(flight.body.rates.z(), 0.4, 0.02);
  const Vec3f stop = flight.cascade.stopping_point();
  flight.run(4000, go_to(stop, static_cast<float>(flight.body.yaw())));
  EXPECT_LT((flight.body.position - stop.cast<double>()).norm(), 0.02);
  EXPECT_LT(flight.body.velocity.norm(), 0.01);
}

TEST(Cascade, AxesMixModes) {
  // Height held while a pilot commands roll and pitch.
  Flight flight;
  CascadeCommand command = go_to({0, 0, 0.5F});
  command.modes.horizontal = AxisMode::kDirect;
  command.direct.roll_rad = 0.2F;
  flight.run(3000, command);
  EXPECT_NEAR(flight.body.position.z(), 0.5, 0.02);
  EXPECT_NEAR(flight.body.roll(), 0.2, 0.01);
}

TEST(Cascade, LimitsForTheMomentHold) {
  Flight flight;
  CascadeCommand command = go_to({3, 0, 0});
  command.limits.speed_m_s = 0.4F;
  command.limits.tilt_rad = 0.1F;
  double fastest = 0, tilt = 0;
  for (int i = 0; i < 5000; ++i) {
    flight.step(command);
    fastest = std::max(fastest, flight.body.velocity.norm());
    tilt = std::max(tilt, flight.body.tilt());
  }
  EXPECT_NEAR(fastest, 0.4, 0.03);
  EXPECT_LT(tilt, 0.115);
  command.limits.thrust_ratio = 0.2F;
  flight.run(500, command);
  EXPECT_NEAR(flight.cascade.output().rpyt.thrust_ratio, 0.2F, 1e-4F);
}

TEST(Cascade, DisabledStopsTheRotorsAndForgetsItsIntegrals) {
  Flight flight;
  flight.body.push_m_s2 = {0.5, 0, 0};
  flight.run(4000, go_to({0, 0, 0}));
  EXPECT_LT(flight.cascade.integral_m_s2().x(), -0.3F);
  const CascadeOutput output = flight.step({});
  for (const float speed : output.rotor_speed_rad_s) EXPECT_EQ(speed, 0);
  EXPECT_EQ(output.rpyt.thrust_ratio, 0);
  EXPECT_EQ(flight.cascade.integral_m_s2(), Vec3f(0, 0, 0));
}

TEST(Cascade, OnTheGroundNothingIsLearned) {
  Cascade cascade({}, QuadrotorModel{});
  ControlState state;
  state.position_m = {0.5F, 0, 0};  // stands beside its goal, and the accelerometer feels the ground
  for (int i = 0; i < 10000; ++i) cascade.step(state, go_to({0, 0, 0}));
  EXPECT_EQ(cascade.integral_m_s2(), Vec3f(0, 0, 0));
  EXPECT_NEAR(cascade.output().hover_thrust_ratio, 0.485F, 1e-3F);
}

TEST(Cascade, WhatIsNoNumberChangesNothingAndIsCounted) {
  Flight flight, other;
  for (int i = 0; i < 1000; ++i) {
    CascadeCommand command = go_to({1, 0, 0});
    other.step(command);
    if (i > 0 && i % 3 == 0) command.goal.position_m.y() = kNan;
    flight.step(command);
  }
  EXPECT_EQ(flight.cascade.bad_commands(), 333U);
  EXPECT_EQ(flight.body.position, other.body.position) << "the last good command stood";
  const CascadeOutput before = flight.cascade.output();
  ControlState state = flight.body.seen();
  state.velocity_m_s.z() = std::numeric_limits<float>::infinity();
  EXPECT_EQ(flight.cascade.step(state, go_to({1, 0, 0})).rotor_speed_rad_s, before.rotor_speed_rad_s);
  state = flight.body.seen();
  state.attitude.x = kNan;
  EXPECT_EQ(flight.cascade.step(state, go_to({1, 0, 0})).rotor_speed_rad_s, before.rotor_speed_rad_s);
  EXPECT_EQ(flight.cascade.bad_states(), 2U);
  flight.run(5000, go_to({0, 0, 0}));
  EXPECT_LT(flight.body.position.norm(), 0.01) << "and it goes on";
}

TEST(Cascade, AnExactMotionIsFollowed) {
  // A circle of 1 m, 4 s a turn: reference with velocity and acceleration, not shaped.
  Flight flight;
  double worst = 0;
  for (int i = 0; i < 12000; ++i) {
    const double w = std::numbers::pi / 2 * std::min(1.0, i / 4000.0), phase = 1e-3 * i;
    const double angle =
        i < 4000 ? std::numbers::pi / 16 * phase * phase : std::numbers::pi / 2 * (phase - 2);
    CascadeCommand command =
        go_to({static_cast<float>(std::sin(angle)), static_cast<float>(1 - std::cos(angle)), 0});
    command.goal.velocity_m_s = {static_cast<float>(w * std::cos(angle)),
                                 static_cast<float>(w * std::sin(angle)), 0};
    command.acceleration_m_s2 = {static_cast<float>(-w * w * std::sin(angle)),
                                 static_cast<float>(w * w * std::cos(angle)), 0};
    command.shaped = false;
    flight.step(command);
    if (i > 8000)
      worst = std::max(worst, std::abs((flight.body.position - Eigen::Vector3d(0, 1, 0)).norm() - 1));
  }
  EXPECT_LT(worst, 0.05);
}

TEST(Cascade, ParametersAreWithinTheirRanges) {
  CascadeParams params;
  QuadrotorModel model;
  ParamList list;
  list.add("control", params);
  list.add("control_shaper", params.shaper);
  list.add("control_position", params.position);
  list.add("control_attitude", params.attitude);
  list.add("control_vehicle", model);
  const auto checked = list.check();
  EXPECT_TRUE(checked) << checked.error().message;
  EXPECT_TRUE(list.set("control.output=attitude_thrust"));
  EXPECT_EQ(params.output, CascadeOutputKind::kAttitudeThrust);
}

TEST(Cascade, TheBitsOfAFlightAreThoseOfEveryProcessor) {
  // Inputs by exact arithmetic only. Seen the same from -O0, -O2, -O3, -O3 -mavx2 and -O1 -mfma. With -O3
  // -mfma g++ 12 needs -fno-tree-slp-vectorize (which this room has): its vectoriser fuses in spite of
  // -ffp-contract=off.
  Cascade cascade({}, QuadrotorModel{});
  ControlState state;
  state.airborne = true;
  cascade.start_from(state, kHovering);
  std::uint64_t hash = 1469598103934665603U;
  std::uint32_t random = 1;
  const auto noise = [&random] {
    random = random * 1664525U + 1013904223U;
    return static_cast<float>(static_cast<std::int32_t>(random >> 8U) - (1 << 23)) * (1.0F / (1 << 23));
  };
  for (int i = 0; i < 5000; ++i) {
    state.position_m += 0.001F * test::drawn<3>(noise);
    state.velocity_m_s = 0.5F * test::drawn<3>(noise);
    state.attitude = normalised({1, 0.1F * noise(), 0.1F * noise(), 0.3F * noise()});
    state.rates_rad_s = test::drawn<3>(noise);
    state.specific_force_m_s2 = Vec3f(0, 0, kGravityF_m_s2 + noise());
    CascadeCommand command = go_to({static_cast<float>(i / 1000), 0.5F, 0.25F}, 1);
    if (i % 1500 > 1000) command.modes = kAllVelocity;
    for (const float speed : cascade.step(state, command).rotor_speed_rad_s)
      hash = (hash ^ std::bit_cast<std::uint32_t>(speed)) * 1099511628211U;
  }
  EXPECT_EQ(hash, 0xb8b11b187a2c54d1U) << std::hex << hash;
}

}  // namespace
}  // namespace hm
