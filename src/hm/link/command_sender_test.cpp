#include "hm/link/command_sender.hpp"

#include <gtest/gtest.h>

#include "hm/link/codec/mavlink_enums.hpp"

namespace hm {
namespace {

constexpr MavlinkAddress kUs{255, 190}, kVehicle{1, 1};

MavCommandLong arm_command() {
  MavCommandLong command;
  command.target_system = 1;
  command.target_component = 1;
  command.command = kMavCommandArmDisarm;
  command.param1 = 1;
  return command;
}
MavCommandAck ack_of(std::uint8_t result) {
  MavCommandAck ack;
  ack.command = kMavCommandArmDisarm;
  ack.result = result;
  return ack;
}
Time at_ms(std::int64_t ms) { return Time{ms * 1'000'000}; }

TEST(CommandSender, RepeatsWithACountUntilItGivesUp) {
  CommandSender sender;
  ASSERT_TRUE(sender.send(arm_command()));
  EXPECT_FALSE(sender.send(arm_command()));
  int sent = 0;
  for (std::int64_t ms = 0; ms < 10'000; ms += 10)
    if (const auto command = sender.poll(at_ms(ms))) {
      EXPECT_EQ(command->confirmation, sent);
      EXPECT_EQ(ms, 500 * sent);
      ++sent;
    }
  EXPECT_EQ(sent, CommandSender::kAttempts);
  EXPECT_EQ(sender.state(), CommandSender::State::kTimedOut);
  EXPECT_TRUE(sender.send(arm_command()));
}

TEST(CommandSender, AnAnswerEndsIt) {
  CommandSender sender;
  sender.send(arm_command());
  EXPECT_FALSE(sender.receive(ack_of(kMavAccepted), kVehicle, kUs, at_ms(0)));  // of nothing that was sent
  sender.poll(at_ms(0));
  EXPECT_TRUE(sender.receive(ack_of(kMavDenied), kVehicle, kUs, at_ms(1)));
  EXPECT_EQ(sender.state(), CommandSender::State::kAnswered);
  EXPECT_EQ(sender.result(), kMavDenied);
  EXPECT_FALSE(sender.poll(at_ms(5000)));
}

TEST(CommandSender, AnswersToOthersOrOfOthersChangeNothing) {
  CommandSender sender;
  sender.send(arm_command());
  sender.poll(at_ms(0));
  MavCommandAck ack = ack_of(kMavAccepted);
  EXPECT_FALSE(sender.receive(ack, {2, 1}, kUs, at_ms(1)));
  EXPECT_FALSE(sender.receive(ack, {1, 100}, kUs, at_ms(1)));
  ack.target_system = 254;
  EXPECT_FALSE(sender.receive(ack, kVehicle, kUs, at_ms(1)));
  ack = ack_of(kMavAccepted);
  ack.command = kMavCommandTakeoff;
  EXPECT_FALSE(sender.receive(ack, kVehicle, kUs, at_ms(1)));
  EXPECT_EQ(sender.state(), CommandSender::State::kWaiting);
}

TEST(CommandSender, ACommandInProgressIsWaitedForAndNotRepeated) {
  CommandSender sender;
  sender.send(arm_command());
  sender.poll(at_ms(0));
  EXPECT_TRUE(sender.receive(ack_of(kMavInProgress), kVehicle, kUs, at_ms(100)));
  EXPECT_FALSE(sender.poll(at_ms(5000)));
  EXPECT_TRUE(sender.receive(ack_of(kMavInProgress), kVehicle, kUs, at_ms(5000)));
  EXPECT_FALSE(sender.poll(at_ms(9999)));
  EXPECT_EQ(sender.state(), CommandSender::State::kWaiting);
  EXPECT_FALSE(sender.poll(at_ms(10'000)));
  EXPECT_EQ(sender.state(), CommandSender::State::kTimedOut);
}

}  // namespace
}  // namespace hm
