// Fail-safes that no fault of the schedule brings about, and other vehicles than the core assumes: in closed
// loop.
#include <gtest/gtest.h>

#include "hm/core/testing/source_folder.hpp"
#include "hm/pipeline/flight/flight_test_support.hpp"

namespace hm {
namespace {

using test::ScriptedFlight;

/// Repeats a command at 20 Hz until a fail-safe acts; seconds that took, -1: never within `most_s`.
double seconds_until(ScriptedFlight& flight, FailSafe which, double most_s,
                     const std::optional<FlightCommand>& repeated = std::nullopt) {
  const Time begin = flight.run.now();
  for (int step = 0; (flight.run.now() - begin).seconds() < most_s; ++step) {
    flight.step(step % 50 == 0 ? repeated : std::nullopt);
    if (flight.now().autopilot.safety.has(which)) return (flight.run.now() - begin).seconds();
  }
  return -1;
}

bool lands(ScriptedFlight& flight, double most_s) {
  return flight.seconds_until([](const auto& m) { return m.autopilot.state == AutopilotState::kIdle; },
                              most_s) >= 0;
}

void enter(ScriptedFlight& flight, FlightPhase mode) {
  FlightCommand command;
  command.kind = CommandKind::kMode;
  command.mode = mode;
  flight.step(command);
  flight.run_s(0.02);
}

/// Attitude commands know no fence: forward, tilted by 4 degrees, at the height where it is: near the ceiling
/// the laser of a braking vehicle would see little else.
FlightCommand forward_by_attitude() {
  FlightCommand command;
  command.kind = CommandKind::kDirect;
  command.pitch_rad = 0.07F;
  command.thrust_ratio = 0.47F;
  return command;
}

TEST(FlightLimits, OutsideOfTheFenceItReturnsAndHoldsInside) {
  FlightRunParams params = test::in_the_room();
  params.autopilot.guidance.fence_radius_m = 1;
  ScriptedFlight flight(params);
  ASSERT_TRUE(flight.take_off(0));
  enter(flight, FlightPhase::kDirect);
  ASSERT_GE(seconds_until(flight, FailSafe::kFenceLeft, 5, forward_by_attitude()), 0);
  EXPECT_NEAR(flight.position().head<2>().norm(), 1.2, 0.1);
  EXPECT_EQ(flight.now().autopilot.phase, FlightPhase::kReturn);
  EXPECT_NEAR(flight.position().z(), 1.3, 0.4);
  flight.run_s(6);
  EXPECT_LT(flight.position().head<2>().norm(), 1.15);
  EXPECT_EQ(flight.now().autopilot.phase, FlightPhase::kHold);
  EXPECT_EQ(flight.now().autopilot.safety.active, 0u);
  EXPECT_EQ(flight.now().collisions, 0u);
}

TEST(FlightLimits, FarOutsideOfTheFenceItLandsAtThePlace) {
  FlightRunParams params = test::in_the_room();
  params.autopilot.guidance.fence_radius_m = 1;
  params.autopilot.fail_safes.fence_land_m = 0.3F;
  ScriptedFlight flight(params);
  ASSERT_TRUE(flight.take_off(0));
  enter(flight, FlightPhase::kDirect);
  ASSERT_GE(seconds_until(flight, FailSafe::kFenceFarOutside, 5, forward_by_attitude()), 0);
  EXPECT_EQ(flight.now().autopilot.state, AutopilotState::kLanding);
  EXPECT_TRUE(lands(flight, 12));
  EXPECT_GT(flight.position().head<2>().norm(), 1.2);
  EXPECT_EQ(flight.now().collisions, 0u);
}

TEST(FlightLimits, FullThrustThatDoesNotCarryTheVehicleMeansALanding) {
  FlightRunParams params;
  params.vehicle.rotor.speed_governed = false;
  params.vehicle.battery.initial_charge_ratio = 0.3;
  params.autopilot.fail_safes.battery_after_s = 60;  // the battery's own fail-safe would land it
  ScriptedFlight flight(params, "fault cell_lost at 7 for 60");
  ASSERT_TRUE(flight.take_off(0));
  flight.run_s(7 - flight.run.elapsed().seconds());
  const double after_s = seconds_until(flight, FailSafe::kNoLift, 3);
  EXPECT_GE(after_s, 1);
  EXPECT_LT(after_s, 3);  // from the moment when it sinks by 0.3 m/s
  EXPECT_EQ(flight.now().autopilot.state, AutopilotState::kLanding);
  EXPECT_TRUE(lands(flight, 8));
  EXPECT_GE(flight.now().feet_down, 3);
}

TEST(FlightLimits, AComputerThatFallsSilentMeansALevelDescent) {
  FlightRunParams params = test::in_the_room();
  FailSafeParams& limits = params.autopilot.fail_safes;
  limits.pose_stale_s = limits.pose_lost_s = limits.height_stale_s = 10;  // nothing else may act
  limits.pose_lost_std_m = 10;
  ScriptedFlight flight(params, "fault link_cut at 7 for 60");
  ASSERT_TRUE(flight.take_off(0));
  flight.run_s(7 - flight.run.elapsed().seconds());
  const double silent_s = seconds_until(flight, FailSafe::kComputerSilent, 2);
  EXPECT_GT(silent_s, 0.94);
  EXPECT_LE(silent_s, 1.002);
  EXPECT_EQ(flight.now().autopilot.safety.reason, FailSafe::kComputerSilent);
  EXPECT_EQ(flight.now().autopilot.state, AutopilotState::kLanding);
  EXPECT_TRUE(lands(flight, 8));
  EXPECT_EQ(flight.now().collisions, 0u);
}

TEST(FlightLimits, VehiclesWithAnAttitudeLoopOfTheirOwnHover) {
  for (const InnerLoopKind loop : {InnerLoopKind::kSecondOrder, InnerLoopKind::kFirstOrder}) {
    FlightRunParams params;
    params.vehicle.inner_loop.inner_loop = loop;
    ScriptedFlight flight(params);
    ASSERT_TRUE(flight.take_off(3)) << static_cast<int>(loop);
    double most_m = 0;
    flight.watched = [&](const FlightMoment& m) {
      most_m = std::max(most_m, m.T_odom_base.translation().head<2>().norm());
    };
    flight.run_s(10);  // with the gust that begins 10 s after the start
    EXPECT_LT(most_m, 0.25) << static_cast<int>(loop);
    EXPECT_GT(most_m, 0.001);
    flight.watched = nullptr;
    flight.send(CommandKind::kLand);
    EXPECT_TRUE(lands(flight, 10)) << static_cast<int>(loop);
    EXPECT_EQ(flight.now().collisions, 0u);
  }
}

TEST(FlightLimits, EveryPresetOfAVehicleHovers) {
  for (const char* name : {"pelican", "city_flyer", "firefly_attitude"}) {
    FlightRunParams params;
    ParamList list = list_flight(params);
    ASSERT_TRUE(list.read_toml_file(test::source_folder() / "configs" / (std::string(name) + ".toml")))
        << name;
    EXPECT_EQ(params.autopilot.law == ControlLaw::kPublished, std::string_view(name) == "city_flyer");
    ScriptedFlight flight(params);
    ASSERT_TRUE(flight.take_off(4)) << name;
    EXPECT_LT(flight.position().head<2>().norm(), 0.25) << name;
    EXPECT_NEAR(flight.position().z(), 1.5, 0.25) << name;
    EXPECT_EQ(flight.now().collisions, 0u);
  }
}

TEST(FlightLimits, ItStopsBeforeAWall) {
  for (const float speed_m_s : {0.5F, 1.0F}) {
    ScriptedFlight flight(test::in_the_room());
    ASSERT_TRUE(flight.take_off(0));
    enter(flight, FlightPhase::kVelocity);
    FlightCommand forward;
    forward.kind = CommandKind::kVelocity;
    forward.velocity_m_s = {speed_m_s, 0, 0};
    ASSERT_GE(seconds_until(flight, FailSafe::kObstacleAhead, 8, forward), 0) << speed_m_s;
    EXPECT_EQ(flight.now().autopilot.phase, FlightPhase::kHold);
    EXPECT_GT(flight.position().x(), 0.5);
    for (int i = 0; i < 60; ++i) {  // the pilot does not give up
      flight.step(forward);
      EXPECT_EQ(flight.now().collisions, 0u) << speed_m_s;
      flight.run_s(0.05);
    }
    EXPECT_EQ(flight.last_refusal, Refusal::kWrongMode);
    EXPECT_LT(flight.now().truth.velocity_world_m_s.norm(), 0.15);
    EXPECT_EQ(flight.now().collisions, 0u);
  }
}

}  // namespace
}  // namespace hm
