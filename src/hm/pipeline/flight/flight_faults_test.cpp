// Every fault of the schedule in closed loop: what the core does, when, and how it ends.
#include <gtest/gtest.h>

#include "hm/pipeline/flight/flight_test_support.hpp"

namespace hm {
namespace {

using test::ScriptedFlight;

constexpr double kFault_s = 7;

struct FaultFlight {
  explicit FaultFlight(const char* fault, const FlightRunParams& params = {}) : flight(params, fault) {
    flies = flight.take_off(0);
    flight.run_s(kFault_s - flight.run.elapsed().seconds());
    flight.watched = [this](const FlightMoment& m) { note(m); };
  }
  void note(const FlightMoment& m) {
    seen |= m.autopilot.safety.active;
    if (m.autopilot.state == AutopilotState::kLanding && !landing_s)
      landing_s = flight.run.elapsed().seconds() - kFault_s;
    if (m.autopilot.state == AutopilotState::kError && !error_s)
      error_s = flight.run.elapsed().seconds() - kFault_s;
  }
  /// Seconds from the fault until this fail-safe acts; -1: never within `most_s`.
  double seconds_until(FailSafe which, double most_s) {
    const double before_s = flight.run.elapsed().seconds() - kFault_s;
    const double waited_s =
        flight.seconds_until([&](const auto& m) { return m.autopilot.safety.has(which); }, most_s);
    return waited_s < 0 ? -1 : before_s + waited_s;
  }
  bool lands(double most_s) {
    const auto idle = [](const auto& m) { return m.autopilot.state == AutopilotState::kIdle; };
    return flight.seconds_until(idle, most_s) >= 0;
  }
  /// It lands within the time, on its feet, and touches nothing else.
  void expect_good_landing(double most_s) {
    EXPECT_TRUE(lands(most_s));
    EXPECT_GE(flight.now().feet_down, 3);
    EXPECT_EQ(flight.now().collisions, 0u);
  }
  /// It flies on, stays near the start, and touches nothing.
  void expect_flies_on(double within_m) {
    EXPECT_EQ(flight.now().autopilot.state, AutopilotState::kFlying);
    EXPECT_LT(flight.position().head<2>().norm(), within_m);
    EXPECT_EQ(flight.now().collisions, 0u);
  }
  /// It holds its position after something that passed.
  void expect_holds(double within_m) {
    EXPECT_EQ(flight.now().autopilot.phase, FlightPhase::kHold);
    expect_flies_on(within_m);
  }
  [[nodiscard]] bool saw(FailSafe which) const { return (seen >> static_cast<unsigned>(which) & 1U) != 0; }
  /// Age of a pose or height at the time when the fault begins: it counts from the measurement.
  static constexpr double kOldest_s = 0.07;

  ScriptedFlight flight;
  bool flies = false;
  std::uint32_t seen = 0;
  std::optional<double> landing_s, error_s;
};

TEST(FlightFaults, ALaserThatEndsMeansDeadReckoningThenADescent) {
  FaultFlight test("fault laser_off at 7 for 60", test::in_the_room());
  ASSERT_TRUE(test.flies);
  const double stale_s = test.seconds_until(FailSafe::kPoseStale, 1);
  EXPECT_GT(stale_s, 0.2 - FaultFlight::kOldest_s);
  EXPECT_LE(stale_s, 0.202);
  EXPECT_EQ(test.flight.now().autopilot.phase, FlightPhase::kDeadReckoning);
  EXPECT_LE(test.seconds_until(FailSafe::kHeightStale, 1), 0.502);
  EXPECT_LE(test.seconds_until(FailSafe::kPoseLost, 1), 1.002);
  EXPECT_EQ(test.flight.now().autopilot.state, AutopilotState::kLanding);
  test.expect_good_landing(6);
}

TEST(FlightFaults, AShortSilenceOfTheLaserEndsInHold) {
  FaultFlight test("fault laser_off at 7 for 0.4");
  ASSERT_TRUE(test.flies);
  test.flight.run_s(3);
  EXPECT_TRUE(test.saw(FailSafe::kPoseStale));
  EXPECT_FALSE(test.saw(FailSafe::kPoseLost));
  test.expect_holds(0.1);
}

TEST(FlightFaults, ALaserThatTurnsIsRefusedAndItLands) {
  FaultFlight test("fault sensor_turned at 7 for 60");
  ASSERT_TRUE(test.flies);
  EXPECT_LE(test.seconds_until(FailSafe::kPoseStale, 1), 0.21);
  EXPECT_LE(test.seconds_until(FailSafe::kPoseLost, 2), 1.01);
  EXPECT_TRUE(test.lands(8));
  EXPECT_LT(test.flight.position().head<2>().norm(), 0.5);
}

/// Few points of the turned scans still pair with those before, or matching begins anew: poses that followed
/// would be turned, and position control spirals on them.
TEST(FlightFaults, PosesAreWithheldWhereTrackingGoesOnByChance) {
  for (const int seed : {1, 6, 7}) {
    FlightRunParams params;
    params.run.seed = seed;
    FaultFlight test("fault sensor_turned at 7 for 60", params);
    ASSERT_TRUE(test.flies);
    const double stale_s = test.seconds_until(FailSafe::kPoseStale, 1);
    EXPECT_GE(stale_s, 0) << seed;
    EXPECT_LE(stale_s, 0.4) << seed;
    double fastest_m_s = 0;
    test.flight.watched = [&](const FlightMoment& m) {
      fastest_m_s = std::max(fastest_m_s, m.truth.velocity_world_m_s.head<2>().norm());
    };
    EXPECT_TRUE(test.lands(8)) << seed;
    EXPECT_LT(fastest_m_s, 0.45) << seed;
  }
}

TEST(FlightFaults, AGapOfTheImuHoldsTheMotorsThenItHolds) {
  FaultFlight test("fault imu_gap at 7 for 0.05");
  ASSERT_TRUE(test.flies);
  const double gap_s = test.seconds_until(FailSafe::kImuGap, 0.1);
  EXPECT_NEAR(gap_s, 0.02, 0.0021);
  test.flight.run_s(3);
  test.expect_holds(0.2);
}

TEST(FlightFaults, AnImuThatEndsOrHangsCutsTheMotors) {
  for (const char* fault : {"fault imu_gap at 7 for 9", "fault imu_stuck at 7 for 9"}) {
    FaultFlight test(fault);
    ASSERT_TRUE(test.flies);
    test.flight.run_s(0.2);
    ASSERT_TRUE(test.error_s) << fault;
    EXPECT_NEAR(*test.error_s, 0.1, 0.0031) << fault;
    EXPECT_EQ(test.flight.now().autopilot.rotor_speed_rad_s, (std::array<float, 4>{}));
  }
}

TEST(FlightFaults, ALostMotorEndsInACut) {
  FaultFlight test("fault motor_lost at 7 for 9");
  ASSERT_TRUE(test.flies);
  test.flight.run_s(2);
  EXPECT_TRUE(test.saw(FailSafe::kOverturned));
  EXPECT_TRUE(test.error_s);
}

TEST(FlightFaults, ACutLinkMeansADescentAndAShortOneHold) {
  FaultFlight test("fault link_cut at 7 for 60", test::in_the_room());
  ASSERT_TRUE(test.flies);
  EXPECT_LE(test.seconds_until(FailSafe::kPoseLost, 2), 1.002);
  const double silent_s = test.seconds_until(FailSafe::kComputerSilent, 2);
  EXPECT_GT(silent_s, 0.95);
  EXPECT_LE(silent_s, 1.002);
  test.expect_good_landing(6);

  FaultFlight brief("fault link_cut at 7 for 0.5");
  brief.flight.run_s(3);
  brief.expect_holds(0.2);
}

TEST(FlightFaults, NoiseOnTheLinkLosesMessagesNotTheVehicle) {
  FaultFlight test("fault link_noise at 7 for 5");
  ASSERT_TRUE(test.flies);
  test.flight.run_s(6);
  test.expect_flies_on(0.15);
  for (const StageCounts& stage : test.flight.run.counts())
    if (stage.stage == "serial up") {
      EXPECT_GT(stage.dropped, 20u);
    }
}

TEST(FlightFaults, AClockThatStepsIsNoticedByNobodyButTheTimeSync) {
  FaultFlight test("fault clock_step at 7 for 2");
  ASSERT_TRUE(test.flies);
  test.flight.run_s(4);
  test.expect_flies_on(0.1);
}

TEST(FlightFaults, ALostCellMeansALandingAfterASecond) {
  FaultFlight test("fault cell_lost at 7 for 60");
  ASSERT_TRUE(test.flies);
  const double empty_s = test.seconds_until(FailSafe::kBatteryEmpty, 2);
  EXPECT_GE(empty_s, 1.0);
  EXPECT_LE(empty_s, 1.102);  // the gauge measures ten times a second
  test.expect_good_landing(10);
}

TEST(FlightFaults, AStrongGustMovesItLittle) {
  FaultFlight test("fault gust at 7 for 3");
  ASSERT_TRUE(test.flies);
  double furthest_m = 0;
  for (int i = 0; i < 5000; ++i) {
    test.flight.step();
    furthest_m = std::max(furthest_m, test.flight.position().head<2>().norm());
  }
  EXPECT_LT(furthest_m, 0.25);
  EXPECT_EQ(test.seen, 0u);
}

TEST(FlightFaults, APilotWhoFallsSilentMeansHoldThenHome) {
  FaultFlight test("");
  ASSERT_TRUE(test.flies);
  test.flight.go_to(1, 0, 1.45);
  const Time last = test.flight.run.now();
  test.flight.sends_life = false;
  const auto since_s = [&] { return (test.flight.run.now() - last).seconds(); };
  ASSERT_GE(test.seconds_until(FailSafe::kPilotLost, 3), 0);
  EXPECT_NEAR(since_s(), 2, 0.003);
  EXPECT_EQ(test.flight.now().autopilot.phase, FlightPhase::kHold);
  ASSERT_GE(test.seconds_until(FailSafe::kPilotGone, 9), 0);
  EXPECT_NEAR(since_s(), 10, 0.003);
  EXPECT_EQ(test.flight.now().autopilot.phase, FlightPhase::kReturn);
  test.expect_good_landing(20);
  EXPECT_LT(test.flight.position().head<2>().norm(), 0.4);  // at home
}

TEST(FlightFaults, AnEmergencyStopCutsInItsStep) {
  FaultFlight test("");
  ASSERT_TRUE(test.flies);
  test.flight.send(CommandKind::kEStop);
  test.flight.run_s(0.005);  // on the serial line
  EXPECT_EQ(test.flight.now().autopilot.state, AutopilotState::kError);
}

}  // namespace
}  // namespace hm
