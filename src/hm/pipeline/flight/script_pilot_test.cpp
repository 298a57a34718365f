#include "hm/pipeline/flight/script_pilot.hpp"

#include <gmock/gmock.h>

#include <map>
#include <numbers>

#include "hm/core/angle.hpp"
#include "hm/flight/flight_text.hpp"
#include "hm/flight/testing/flight_rig.hpp"
#include "hm/pipeline/flight/onboard_computer.hpp"

namespace hm {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// A pilot and the vehicle that it flies: the autopilot with a body, without a world.
class Flight {
 public:
  explicit Flight(std::string_view script, const PilotParams& params = {}) : pilot(params) {
    const auto parsed = parse_flight_script(script, "script");
    EXPECT_TRUE(parsed) << (parsed ? "" : to_string(parsed.error()));
    for (const FlightOrder& order : parsed->orders) pilot.add(order);
    pilot.close();
  }
  Flight() = default;

  /// One millisecond.
  void step() {
    const auto command = drop_commands ? (void)pilot.step(view()), std::nullopt : pilot.step(view());
    answered_.reset();
    if (!command) return rig.run_ms(1);
    ++sent[command->kind];
    refusal_ = rig.send(in_odom(*command, T_map_odom));
    answered_ = command->kind;
  }
  /// Until the pilot has released control, or so many seconds are over.
  void run(double most_s = 200) {
    for (int i = 0; i < static_cast<int>(most_s * 1000) && !pilot.is_over(); ++i) step();
  }
  template <class Condition>
  bool run_until(Condition condition, double most_s = 60) {
    for (int i = 0; i < static_cast<int>(most_s * 1000); ++i) {
      if (condition()) return true;
      step();
    }
    return false;
  }
  [[nodiscard]] std::vector<std::string> outcomes() const {
    std::vector<std::string> texts;
    for (const OrderRecord& record : pilot.records())
      texts.push_back(record.order.text + ": " + std::string(to_string(record.outcome)));
    return texts;
  }
  [[nodiscard]] const AutopilotOutputs& outputs() const { return rig.autopilot->outputs(); }

  FlightRig rig;
  ScriptPilot pilot;
  std::map<CommandKind, int> sent;
  bool drop_commands = false;
  SE2 T_map_odom;

 private:
  [[nodiscard]] PilotView view() const {
    const AutopilotOutputs& outputs = rig.autopilot->outputs();
    const BasicVehicleState<float> estimate = rig.autopilot->estimate();
    PilotView view{
        rig.now + Duration{1'000'000}, outputs.state, outputs.phase, {}, {}, {}, 0, {}, {}, T_map_odom};
    if (outputs.safety.action != SafetyAction::kNone) view.reason = outputs.safety.reason;
    view.position_m = estimate.position_m;
    view.position_m.head<2>() =
        (T_map_odom * Vec2(estimate.position_m.head<2>().cast<double>())).cast<float>();
    view.velocity_m_s = estimate.velocity_m_s;
    view.yaw_rad = estimate.roll_pitch_yaw_rad.z();
    view.answered = answered_;
    view.refusal = refusal_;
    return view;
  }
  std::optional<CommandKind> answered_;
  Refusal refusal_ = Refusal::kNone;
};

TEST(ScriptPilot, TakesOffHoversLandsAndStopsTheMotors) {
  Flight flight("takeoff 1.0\nhold\nwait 3\nland\n");
  double highest_m = 0;
  while (!flight.pilot.is_over() && flight.rig.now.seconds() < 100) {
    flight.step();
    highest_m = std::max(highest_m, flight.rig.body.position.z());
  }
  EXPECT_THAT(flight.outcomes(),
              ElementsAre("takeoff 1.0: done", "hold: done", "wait 3: done", "land: done"));
  EXPECT_NEAR(highest_m, FlightRig::kFeet_m + 1.0, 0.1);
  EXPECT_TRUE(flight.rig.stands());
  EXPECT_EQ(flight.outputs().state, AutopilotState::kOff);
  EXPECT_EQ(flight.rig.autopilot->gate().pilot(), 0) << "control is released";
  EXPECT_EQ(flight.sent[CommandKind::kTakeOver], 1);
  EXPECT_EQ(flight.sent[CommandKind::kToggleEngage], 2);
  EXPECT_GE(flight.sent[CommandKind::kSignOfLife], 5)
      << "it waits longer than without a sign of life allowed";
  EXPECT_EQ(flight.rig.autopilot->gate().refused(Refusal::kBackwardStamp), 0U);
}

TEST(ScriptPilot, YieldsToAPilotWhoTakesControlOverAndComesBackForAnOrder) {
  Flight flight;
  const auto script = parse_flight_script("takeoff 1.0\nhold\nwait 100\nland\n", "script");
  for (const FlightOrder& order : script->orders) flight.pilot.add(order);
  ASSERT_TRUE(flight.run_until([&] { return flight.pilot.records()[1].outcome == OrderOutcome::kDone; }));
  FlightCommand other;
  other.kind = CommandKind::kTakeOver;
  other.pilot = 2;

  ASSERT_EQ(flight.rig.send(other), Refusal::kNone);
  ASSERT_TRUE(flight.run_until([&] { return flight.pilot.records()[2].outcome == OrderOutcome::kSkipped; }));
  EXPECT_EQ(flight.pilot.records()[2].reason, "another pilot has taken control");
  const int take_overs = flight.sent[CommandKind::kTakeOver];
  for (int i = 0; i < 3000; ++i) flight.step();
  EXPECT_EQ(flight.sent[CommandKind::kTakeOver], take_overs);
  FlightOrder land;
  land.kind = FlightOrder::Kind::kLand;
  flight.pilot.add(land);
  ASSERT_TRUE(flight.run_until([&] { return flight.pilot.records().back().outcome == OrderOutcome::kDone; }));
  EXPECT_EQ(flight.sent[CommandKind::kTakeOver], take_overs + 1);
}

TEST(ScriptPilot, PassesWayPointsAndRestsAtTheLast) {
  Flight flight("takeoff 1\ngoto 1 0 1.2\ngoto 1 1.5 1.2\ngoto 0 1.5 1.2 90\nland");
  ASSERT_TRUE(flight.run_until([&] { return flight.pilot.records()[1].outcome == OrderOutcome::kDone; }));
  EXPECT_NEAR((flight.rig.body.position - Eigen::Vector3d(1, 0, 1.2)).norm(), 0.1, 0.05);
  EXPECT_GT(flight.rig.body.velocity.norm(), 0.2) << "it passes";
  ASSERT_TRUE(flight.run_until([&] { return flight.pilot.records()[3].outcome == OrderOutcome::kDone; }));
  EXPECT_LT(flight.rig.body.velocity.norm(), 0.2);
  EXPECT_NEAR(flight.rig.body.yaw(), 90 * kRadiansPerDegree, 0.12);
  EXPECT_LT(flight.pilot.records()[3].distance_m, 0.1);
  flight.run();
  EXPECT_EQ(flight.pilot.records().back().outcome, OrderOutcome::kDone);
}

/// A loop that is closed on the way moves the goal in `odom`; the vehicle arrives where the goal is in `map`.
TEST(ScriptPilot, AGoalFollowsTheCorrectionsOfTheMap) {
  Flight flight("takeoff 1.3\ngoto 2 1 1.3 0\nwait 3\nland");
  ASSERT_TRUE(flight.run_until([&] { return flight.rig.autopilot->estimate().position_m.x() > 1; }));
  flight.T_map_odom = SE2(Vec2(0.2, -0.1), 0.03);
  ASSERT_TRUE(flight.run_until([&] { return flight.outputs().state == AutopilotState::kLanding; }));
  EXPECT_EQ(flight.pilot.records()[1].outcome, OrderOutcome::kDone);
  EXPECT_EQ(flight.sent[CommandKind::kGoTo], 2);
  const Vec2 expected_m = flight.T_map_odom.inverse() * Vec2(2, 1);
  const Vec2 flown_m = flight.rig.autopilot->estimate().position_m.head<2>().cast<double>();
  EXPECT_LT((flown_m - expected_m).norm(), 0.05);
}

TEST(ScriptPilot, GoalsReachTheBoardInItsFrame) {
  FlightCommand command;
  command.kind = CommandKind::kGoTo;
  command.position_m = {1, 0, 1.3F};
  const FlightCommand sent = in_odom(command, SE2(Vec2(1, 2), std::numbers::pi / 2));
  EXPECT_LT((sent.position_m - Vec3f(-2, 0, 1.3F)).norm(), 1e-6F);
  EXPECT_NEAR(sent.yaw_rad, -std::numbers::pi / 2, 1e-6);
  command.kind = CommandKind::kVelocity;  // in the frame of the vehicle
  EXPECT_EQ(in_odom(command, SE2(Vec2(1, 2), 1)).position_m, command.position_m);
}

TEST(ScriptPilot, RepeatsVelocitiesAndThenHolds) {
  Flight flight("takeoff 1\nvelocity 0.5 0 0 0 for 3\nwait 2\nland");
  ASSERT_TRUE(flight.run_until([&] { return flight.pilot.records()[1].outcome == OrderOutcome::kDone; }));
  EXPECT_NEAR(flight.sent[CommandKind::kVelocity], 60, 2);
  EXPECT_EQ(flight.sent[CommandKind::kMode], 1);
  const double x = flight.rig.body.position.x();
  EXPECT_NEAR(x, 1.3, 0.3);
  ASSERT_TRUE(flight.run_until([&] { return flight.pilot.records()[2].outcome == OrderOutcome::kDone; }));
  EXPECT_EQ(flight.outputs().phase, FlightPhase::kHold);
  EXPECT_LT(flight.rig.body.position.x(), x + 0.5);
}

/// Also where the answer to a step comes late: a second one would be added to it.
TEST(ScriptPilot, StepsFromWhereItIs) {
  Flight flight("takeoff 1\ngoto 1 0 1 90\nstep 0.8 0 0.2 -90\nstep 0 0.5 0\nland");
  ASSERT_TRUE(flight.run_until([&] {
    return flight.pilot.records()[3].outcome != OrderOutcome::kRunning &&
           flight.pilot.records()[3].outcome != OrderOutcome::kWaiting;
  }));
  EXPECT_EQ(flight.pilot.records()[2].outcome, OrderOutcome::kDone);
  EXPECT_EQ(flight.pilot.records()[3].outcome, OrderOutcome::kDone);
  EXPECT_EQ(flight.sent[CommandKind::kPositionStep], 2);
  const Vec3 place_m = flight.rig.body.position - Vec3(0, 0, FlightRig::kFeet_m);
  EXPECT_LT((place_m - Vec3(1, 1.3, 1.2)).norm(), 0.3)
      << "0.8 m ahead of a heading of 90 degrees, 0.5 m to its left";
  EXPECT_NEAR(flight.rig.autopilot->estimate().roll_pitch_yaw_rad.z(), 0, 0.1);
}

TEST(ScriptPilot, AStepOutOfRangeIsMissed) {
  Flight flight("takeoff 1\nstep 900 0 0\nland");
  flight.run();
  EXPECT_THAT(flight.outcomes(), ElementsAre("takeoff 1: done", "step 900 0 0: missed", "land: done"));
  EXPECT_EQ(flight.pilot.records()[1].reason, text_of(Refusal::kOutOfRange));
}

TEST(ScriptPilot, ReturnsAlongItsPathAndLands) {
  Flight flight("takeoff 1\ngoto 2 0 1\ngoto 2 2 1\nreturn");
  double nearest_corner_m = 9;
  ASSERT_TRUE(flight.run_until([&] { return flight.outputs().phase == FlightPhase::kReturn; }));
  while (!flight.pilot.is_over() && flight.rig.now.seconds() < 200) {
    flight.step();
    nearest_corner_m = std::min(nearest_corner_m, (flight.rig.body.position.head<2>() - Vec2(2, 0)).norm());
  }
  EXPECT_THAT(flight.outcomes(),
              ElementsAre("takeoff 1: done", "goto 2 0 1: done", "goto 2 2 1: done", "return: done"));
  EXPECT_LT(nearest_corner_m, 0.4) << "not straight home";
  EXPECT_LT(flight.rig.body.position.head<2>().norm(), 0.3);
  EXPECT_TRUE(flight.rig.stands());
  EXPECT_EQ(flight.outputs().state, AutopilotState::kOff);
}

TEST(ScriptPilot, AddsTheLandingThatAScriptLacks) {
  Flight flight("takeoff 0.6\nwait 1");
  flight.run();
  EXPECT_THAT(flight.outcomes(), ElementsAre("takeoff 0.6: done", "wait 1: done", "land: done"));
  EXPECT_TRUE(flight.rig.stands());
}

TEST(ScriptPilot, LandsWhenItIsToldTo) {
  Flight flight("takeoff 1\ngoto 5 0 1\nwait 100");
  ASSERT_TRUE(flight.run_until([&] { return flight.rig.body.position.x() > 1; }));
  flight.pilot.land_now("Ctrl-C");
  flight.run();
  EXPECT_THAT(flight.outcomes(),
              ElementsAre("takeoff 1: done", "goto 5 0 1: skipped", "wait 100: skipped", "land: done"));
  EXPECT_EQ(flight.pilot.records()[1].reason, "Ctrl-C");
  EXPECT_EQ(flight.outputs().state, AutopilotState::kOff);
  Flight early("takeoff 1\nwait 100");
  early.run(0.1);
  early.pilot.land_now("Ctrl-C");
  early.run(20);
  EXPECT_TRUE(early.pilot.is_over()) << "while the motors are being started";
  EXPECT_EQ(early.outputs().state, AutopilotState::kOff);
}

TEST(ScriptPilot, GivesUpWithoutAPosition) {
  PilotParams params;
  params.ready_s = 3;
  Flight flight("takeoff 1\ngoto 1 0 1\nland", params);
  flight.rig.pose = false;
  flight.run(30);
  EXPECT_TRUE(flight.pilot.is_over());
  EXPECT_THAT(flight.outcomes(),
              ElementsAre("takeoff 1: missed", "goto 1 0 1: skipped", "land: skipped", "land: done"));
  EXPECT_THAT(flight.pilot.records()[0].reason, HasSubstr("position, height or attitude is not known yet"));
  EXPECT_EQ(flight.outputs().state, AutopilotState::kOff);
}

TEST(ScriptPilot, SaysWhyAGoalWasMissed) {
  Flight flight("takeoff 1\ngoto 900 0 1\ngoto 1 0 1\nvelocity 9 0 0 0 for 1\nland");
  flight.run();
  EXPECT_THAT(flight.outcomes(), ElementsAre("takeoff 1: done", "goto 900 0 1: missed", "goto 1 0 1: done",
                                             "velocity 9 0 0 0 for 1: missed", "land: done"));
  EXPECT_EQ(flight.pilot.records()[1].reason, text_of(Refusal::kOutOfRange));
  EXPECT_EQ(flight.pilot.records()[3].reason, text_of(Refusal::kOutOfRange));
}

TEST(ScriptPilot, MissesWhatAFailSafePrevents) {
  Flight flight("takeoff 1\ngoto 3 0 1\ngoto 0 0 1\nland");
  flight.rig.battery_ratio = 0.9F;
  ASSERT_TRUE(flight.run_until([&] { return flight.rig.body.position.x() > 1; }));
  flight.rig.battery_ratio = 0.05F;
  flight.run();
  EXPECT_THAT(flight.outcomes(),
              ElementsAre("takeoff 1: done", "goto 3 0 1: missed", "goto 0 0 1: missed", "land: done"));
  EXPECT_THAT(flight.pilot.records()[1].reason, HasSubstr("the vehicle is landing: "));
  EXPECT_TRUE(flight.rig.stands());
}

TEST(ScriptPilot, GoesOnAfterAShortLossOfThePose) {
  Flight flight("takeoff 1\ngoto 2 0 1\nland");
  ASSERT_TRUE(flight.run_until([&] { return flight.rig.body.position.x() > 0.5; }));
  flight.rig.pose = false;
  ASSERT_TRUE(flight.run_until([&] { return flight.outputs().phase == FlightPhase::kDeadReckoning; }, 2));
  flight.rig.pose = true;
  flight.run();
  EXPECT_THAT(flight.outcomes(), ElementsAre("takeoff 1: done", "goto 2 0 1: done", "land: done"));
  EXPECT_GE(flight.sent[CommandKind::kGoTo], 2) << "the goal is given again";
}

TEST(ScriptPilot, RepeatsWhatTheLinkLoses) {
  Flight flight("takeoff 1\nland");
  flight.drop_commands = true;
  flight.run(1.5);
  flight.drop_commands = false;
  flight.run();
  EXPECT_THAT(flight.outcomes(), ElementsAre("takeoff 1: done", "land: done"));
}

TEST(ScriptPilot, SkipsTheRestAfterAnEmergencyStop) {
  Flight flight("takeoff 1\nestop\nwait 5");
  flight.run(60);
  EXPECT_TRUE(flight.pilot.is_over());
  EXPECT_THAT(flight.outcomes(), ElementsAre("takeoff 1: done", "estop: done", "wait 5: skipped"));
  EXPECT_EQ(flight.outputs().state, AutopilotState::kError);
}

TEST(ScriptPilot, TakesOrdersWhileItFlies) {
  const auto order = [](std::string_view line) {
    return std::get<FlightOrder>(parse_flight_line(line, "live").value());
  };
  Flight flight;
  flight.run(2);
  EXPECT_FALSE(flight.pilot.is_over()) << "more may come";
  flight.pilot.add(order("takeoff 1"));
  flight.pilot.add(order("goto 4 0 1"));
  flight.pilot.add(order("wait 60"));
  ASSERT_TRUE(flight.run_until([&] { return flight.rig.body.position.x() > 1; }));
  ASSERT_NE(flight.pilot.current(), nullptr);
  EXPECT_EQ(flight.pilot.current()->order.text, "goto 4 0 1");
  flight.pilot.interrupt(order("hold"));
  ASSERT_TRUE(flight.run_until([&] { return flight.pilot.current() == nullptr; }, 10));
  EXPECT_LT(flight.rig.body.position.x(), 3);
  flight.run(5);
  EXPECT_EQ(flight.outputs().phase, FlightPhase::kHold) << "it stays until the next order";
  flight.pilot.close();
  flight.run();
  EXPECT_THAT(flight.outcomes(), ElementsAre("takeoff 1: done", "goto 4 0 1: skipped", "wait 60: skipped",
                                             "hold: done", "land: done"));
}

TEST(ScriptPilot, TakesControlFromAnotherPilot) {
  Flight flight("takeoff 0.5\nland");
  FlightCommand other;
  other.pilot = 9;
  ASSERT_EQ(flight.rig.send(other), Refusal::kNone);
  ASSERT_EQ(flight.rig.autopilot->gate().pilot(), 9);
  flight.run();
  EXPECT_THAT(flight.outcomes(), ElementsAre("takeoff 0.5: done", "land: done"));
}

}  // namespace
}  // namespace hm
