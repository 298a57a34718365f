#include "hm/flight/command_gate.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace hm {
namespace {

Time at_ms(int count) { return Time{std::int64_t{1'000'000} * count}; }

FlightCommand command(CommandKind kind, int stamp_ms, std::uint8_t pilot = 1) {
  FlightCommand result;
  result.kind = kind;
  result.stamp = at_ms(stamp_ms);
  result.pilot = pilot;
  return result;
}

TEST(CommandGate, StampsMustRunForwardAndBeRecent) {
  CommandGate gate;
  EXPECT_EQ(gate.admit(command(CommandKind::kHold, 1000), at_ms(1010)), Refusal::kNone);
  EXPECT_EQ(gate.admit(command(CommandKind::kHold, 1000), at_ms(1011)), Refusal::kBackwardStamp);  // twice
  EXPECT_EQ(gate.admit(command(CommandKind::kHold, 999), at_ms(1012)), Refusal::kBackwardStamp);
  EXPECT_EQ(gate.admit(command(CommandKind::kHold, 1100), at_ms(1601)), Refusal::kStaleStamp);
  EXPECT_EQ(gate.admit(command(CommandKind::kHold, 1101), at_ms(1601)), Refusal::kNone);
  EXPECT_EQ(gate.admit(command(CommandKind::kHold, 1652), at_ms(1601)), Refusal::kFutureStamp);
  EXPECT_EQ(gate.admit(command(CommandKind::kHold, 1650), at_ms(1601)), Refusal::kNone);
  EXPECT_EQ(gate.refused(Refusal::kBackwardStamp), 2u);
  EXPECT_EQ(gate.refused(Refusal::kStaleStamp), 1u);
  EXPECT_EQ(gate.refused(Refusal::kFutureStamp), 1u);
}

TEST(CommandGate, OnePilotAtATime) {
  CommandGate gate;
  EXPECT_EQ(gate.pilot(), 0);
  EXPECT_EQ(gate.last_heard(), std::nullopt);
  EXPECT_EQ(gate.admit(command(CommandKind::kSignOfLife, 1000, 1), at_ms(1000)), Refusal::kNone);
  EXPECT_EQ(gate.pilot(), 1);
  EXPECT_EQ(gate.admit(command(CommandKind::kLand, 1001, 2), at_ms(1001)), Refusal::kOtherPilot);
  EXPECT_EQ(gate.last_heard(), at_ms(1000));  // the other one is no sign of life
  EXPECT_EQ(gate.admit(command(CommandKind::kEStop, 0, 2), at_ms(1001)),
            Refusal::kNone);  // anybody, any stamp
  EXPECT_EQ(gate.pilot(), 1);
  EXPECT_EQ(gate.admit(command(CommandKind::kTakeOver, 1002, 2), at_ms(1002)), Refusal::kNone);
  EXPECT_EQ(gate.pilot(), 2);
  EXPECT_EQ(gate.admit(command(CommandKind::kHold, 1003, 1), at_ms(1003)), Refusal::kOtherPilot);
  EXPECT_EQ(gate.admit(command(CommandKind::kRelease, 1004, 2), at_ms(1004)), Refusal::kNone);
  EXPECT_EQ(gate.pilot(), 0);
  EXPECT_EQ(gate.admit(command(CommandKind::kHold, 1005, 1), at_ms(1005)), Refusal::kNone);
  EXPECT_EQ(gate.pilot(), 1);
  EXPECT_EQ(gate.admit(command(CommandKind::kHold, 1006, 0), at_ms(1006)), Refusal::kNoPilot);
  EXPECT_EQ(gate.refused(Refusal::kOtherPilot), 2u);
}

TEST(CommandGate, APilotsStampsOutliveTheChangeOfPilots) {
  CommandGate gate;
  EXPECT_EQ(gate.admit(command(CommandKind::kHold, 1000, 1), at_ms(1000)), Refusal::kNone);
  EXPECT_EQ(gate.admit(command(CommandKind::kTakeOver, 1001, 2), at_ms(1001)), Refusal::kNone);
  EXPECT_EQ(gate.admit(command(CommandKind::kTakeOver, 1000, 1), at_ms(1002)),
            Refusal::kBackwardStamp);  // replayed
}

TEST(CommandGate, ValuesAreFiniteAndWithinLimits) {
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinity = std::numeric_limits<float>::infinity();
  int stamp_ms = 1000;
  CommandGate gate;
  const auto judge = [&](FlightCommand given) {
    given.stamp = at_ms(++stamp_ms);
    return gate.admit(given, given.stamp);
  };
  for (int kind = 0; kind < kCommandKindCount; ++kind) {
    if (static_cast<CommandKind>(kind) == CommandKind::kEStop) continue;
    for (const float bad : {nan, infinity, -infinity}) {
      for (float FlightCommand::*member :
           {&FlightCommand::yaw_rad, &FlightCommand::roll_rad, &FlightCommand::pitch_rad,
            &FlightCommand::yaw_rate_rad_s, &FlightCommand::thrust_ratio}) {
        FlightCommand given = command(static_cast<CommandKind>(kind), 0);
        given.*member = bad;
        EXPECT_EQ(judge(given), Refusal::kNotANumber) << kind;
      }
      for (Vec3f FlightCommand::*member :
           {&FlightCommand::position_m, &FlightCommand::velocity_m_s, &FlightCommand::acceleration_m_s2}) {
        FlightCommand given = command(static_cast<CommandKind>(kind), 0);
        (given.*member).y() = bad;
        EXPECT_EQ(judge(given), Refusal::kNotANumber) << kind;
      }
    }
  }
  FlightCommand velocity = command(CommandKind::kVelocity, 0);
  velocity.velocity_m_s = {1.2F, 1.2F, 0};
  EXPECT_EQ(judge(velocity), Refusal::kOutOfRange);
  velocity.velocity_m_s = {1.0F, 1.0F, 0};
  EXPECT_EQ(judge(velocity), Refusal::kNone);
  velocity.yaw_rad = 1.1F;
  EXPECT_EQ(judge(velocity), Refusal::kOutOfRange);
  FlightCommand step = command(CommandKind::kPositionStep, 0);
  step.position_m = {0, 1.01F, 0};
  EXPECT_EQ(judge(step), Refusal::kOutOfRange);
  FlightCommand direct = command(CommandKind::kDirect, 0);
  direct.thrust_ratio = 1.01F;
  EXPECT_EQ(judge(direct), Refusal::kOutOfRange);
  direct.thrust_ratio = 0.5F;
  direct.pitch_rad = -0.51F;
  EXPECT_EQ(judge(direct), Refusal::kOutOfRange);
}

}  // namespace
}  // namespace hm
