#include "hm/pipeline/flight/external/offboard_pilot.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace hm {
namespace {

/// A pilot of an autopilot that stands ready, or flies at (1, 2, 3), heading left.
struct Offboard {
  OffboardPilot pilot;
  OffboardView view;
  Offboard() {
    view.now = Time{1'000'000'000};
    view.ready = true;
    view.autopilot = kMavAutopilotPx4;
    view.estimate.position_m = {1, 2, 3};
    view.estimate.roll_pitch_yaw_rad.z() = std::numbers::pi_v<float> / 2;
    pilot.update(view);
  }
  FlightCommand command(CommandKind kind) {
    view.now = view.now + Duration{10'000'000};
    FlightCommand command;
    command.kind = kind;
    command.pilot = 1;
    command.stamp = view.now;
    return command;
  }
  Refusal give(CommandKind kind) { return pilot.obey(command(kind), view); }
  void fly() {
    view.armed = true;
    pilot.update(view);
    EXPECT_EQ(give(CommandKind::kTakeOff), Refusal::kNone);
    view.estimate.position_m = pilot.set_point()->position_m->cast<float>();
    pilot.update(view);
    EXPECT_EQ(pilot.phase(), FlightPhase::kPosition);
  }
};

TEST(OffboardPilot, EngagingAsksForOffboardModeThenArms) {
  Offboard flown;
  EXPECT_EQ(flown.give(CommandKind::kTakeOff), Refusal::kMotorsOff);
  EXPECT_EQ(flown.give(CommandKind::kToggleEngage), Refusal::kNone);
  ASSERT_EQ(flown.pilot.commands().size(), 2U);
  EXPECT_EQ(flown.pilot.commands()[0].command, kMavCommandSetMode);
  EXPECT_EQ(flown.pilot.commands()[0].param2, 6);
  EXPECT_EQ(flown.pilot.commands()[1].command, kMavCommandArmDisarm);
  EXPECT_EQ(flown.pilot.commands()[1].param1, 1);
  EXPECT_EQ(flown.give(CommandKind::kToggleEngage), Refusal::kInTransition);
  flown.view.ready = false;
  flown.pilot.commands().clear();
  EXPECT_EQ(flown.give(CommandKind::kToggleEngage), Refusal::kNotReady);
}

TEST(OffboardPilot, ArdupilotIsGuidedAndToldToTakeOff) {
  Offboard flown;
  flown.view.autopilot = kMavAutopilotArdupilot;
  flown.give(CommandKind::kToggleEngage);
  EXPECT_EQ(flown.pilot.commands()[0].param2, 4);
  flown.pilot.commands().clear();
  flown.view.armed = true;
  flown.pilot.update(flown.view);
  FlightCommand up = flown.command(CommandKind::kTakeOff);
  up.position_m.z() = 1.5F;
  EXPECT_EQ(flown.pilot.obey(up, flown.view), Refusal::kNone);
  EXPECT_EQ(flown.pilot.commands().at(0).command, kMavCommandTakeoff);
  EXPECT_EQ(flown.pilot.commands().at(0).param7, 1.5F);
}

TEST(OffboardPilot, VelocitiesAreOfTheVehicleAndAge) {
  Offboard flown;
  flown.fly();
  FlightCommand forward = flown.command(CommandKind::kVelocity);
  forward.velocity_m_s = {1, 0, 0};
  EXPECT_EQ(flown.pilot.obey(forward, flown.view), Refusal::kWrongMode);
  FlightCommand mode = flown.command(CommandKind::kMode);
  mode.mode = FlightPhase::kVelocity;
  EXPECT_EQ(flown.pilot.obey(mode, flown.view), Refusal::kNone);
  forward.stamp = flown.command(CommandKind::kVelocity).stamp;
  EXPECT_EQ(flown.pilot.obey(forward, flown.view), Refusal::kNone);
  EXPECT_LT((*flown.pilot.set_point()->velocity_m_s - Vec3(0, 1, 0)).norm(), 1e-6);  // it heads left
  flown.view.now = flown.view.now + OffboardPilot::kVelocityValid;
  flown.pilot.update(flown.view);
  EXPECT_EQ(flown.pilot.phase(), FlightPhase::kVelocity);
  flown.view.now = flown.view.now + Duration{1'000'000};
  flown.pilot.update(flown.view);
  EXPECT_EQ(flown.pilot.phase(), FlightPhase::kHold);
  EXPECT_TRUE(flown.pilot.set_point()->position_m.has_value());
}

TEST(OffboardPilot, LandingStopsTheSetPointsAndEndsDisarmed) {
  Offboard flown;
  flown.fly();
  flown.view.landed = kMavInAir;
  EXPECT_EQ(flown.give(CommandKind::kLand), Refusal::kNone);
  EXPECT_FALSE(flown.pilot.set_point());
  EXPECT_EQ(flown.pilot.commands().at(0).command, kMavCommandLand);
  flown.pilot.update(flown.view);
  EXPECT_EQ(flown.pilot.state(), AutopilotState::kLanding);
  EXPECT_EQ(flown.give(CommandKind::kGoTo), Refusal::kLandingForced);
  flown.view.landed = kMavOnGround;
  flown.pilot.update(flown.view);
  EXPECT_EQ(flown.pilot.state(), AutopilotState::kIdle);
  flown.view.armed = false;
  flown.pilot.update(flown.view);
  EXPECT_EQ(flown.pilot.state(), AutopilotState::kOff);
}

TEST(OffboardPilot, TheEmergencyStopIsLatchedAndForgetsWhatWaits) {
  Offboard flown;
  flown.fly();
  flown.give(CommandKind::kLand);
  EXPECT_EQ(flown.give(CommandKind::kEStop), Refusal::kNone);
  ASSERT_EQ(flown.pilot.commands().size(), 1U);
  EXPECT_EQ(flown.pilot.commands()[0].param2, 21196);
  EXPECT_EQ(flown.give(CommandKind::kTakeOff), Refusal::kErrorLatched);
  EXPECT_EQ(flown.give(CommandKind::kReset), Refusal::kMotorsOn);
  flown.view.armed = false;
  EXPECT_EQ(flown.give(CommandKind::kReset), Refusal::kNone);
  EXPECT_EQ(flown.pilot.state(), AutopilotState::kOff);
}

}  // namespace
}  // namespace hm
