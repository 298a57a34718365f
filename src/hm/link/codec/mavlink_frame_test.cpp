#include "hm/link/codec/mavlink_frame.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include <vector>

#include "hm/link/codec/mavlink_enums.hpp"
#include "hm/link/codec/mavlink_parser.hpp"
#include "hm/link/testing/random_messages.hpp"

namespace hm {
namespace {

using link_testing::parse_all;
using link_testing::random_frame;
using link_testing::random_message;
using link_testing::wire_bytes;

template <class Message>
std::vector<std::uint8_t> payload_of(const Message& message) {
  std::array<std::uint8_t, kMavlinkMaxPayload> payload{};
  store_mavlink_payload(message, payload);
  return {payload.begin(), payload.end()};
}

TEST(MavlinkFrame, EveryMessageWithRandomFieldsComesBack) {
  Rng rng(7);
  MavlinkMessages::for_each([&]<class Message>() {
    for (int i = 0; i < 200; ++i) {
      const auto sent = random_message<Message>(rng);
      MavlinkParser parser;
      const auto frames =
          parse_all(parser, wire_bytes(make_mavlink_frame(sent, {3, 191}, static_cast<std::uint8_t>(i))));
      ASSERT_EQ(frames.size(), 1U) << Message::kName;
      EXPECT_EQ(frames[0].sequence, static_cast<std::uint8_t>(i));
      EXPECT_EQ(frames[0].from, (MavlinkAddress{3, 191}));
      const auto received = read_mavlink_message<Message>(frames[0]);
      ASSERT_TRUE(received);
      // NaNs too, bit by bit.
      EXPECT_EQ(payload_of(*received), payload_of(sent)) << Message::kName;
    }
  });
}

TEST(MavlinkFrame, FieldsStandWhereTheProtocolHasThem) {
  MavHeartbeat heartbeat;
  heartbeat.type = kMavTypeQuadrotor;
  heartbeat.autopilot = kMavAutopilotPx4;
  heartbeat.base_mode = 81;
  heartbeat.custom_mode = 0x01020304;
  heartbeat.system_status = 3;
  const auto bytes = wire_bytes(make_mavlink_frame(heartbeat, {1, 1}, 78));
  const std::vector<std::uint8_t> expected{0xFD, 9, 0, 0, 78, 1, 1, 0, 0, 0, 4, 3, 2, 1, 2, 12, 81, 3, 3};
  ASSERT_EQ(bytes.size(), expected.size() + 2);
  EXPECT_TRUE(std::equal(expected.begin(), expected.end(), bytes.begin()));
}

TEST(MavlinkFrame, TrailingZerosAreNotSentAndComeBackAsZeros) {
  MavCommandAck ack;
  ack.command = 22;
  EXPECT_EQ(make_mavlink_frame(ack, {}, 0).length, 1);
  ack.target_component = 5;
  EXPECT_EQ(make_mavlink_frame(ack, {}, 0).length, 10);
  // All zero: one byte of payload stays. Other senders leave none; both are read.
  const auto zero = make_mavlink_frame(MavTimesync{}, {}, 0);
  EXPECT_EQ(zero.length, 1);
  MavlinkFrame empty = zero;
  empty.length = 0;
  MavlinkParser parser;
  EXPECT_EQ(parse_all(parser, wire_bytes(empty)).size(), 1U);
}

TEST(MavlinkFrame, LongerMessagesOfNewerSendersAreReadUpToWhatWeKnow) {
  Rng rng(5);
  const auto sent = random_message<MavHeartbeat>(rng);
  MavlinkFrame frame = make_mavlink_frame(sent, {}, 0);
  frame.length = 40;
  for (std::size_t i = 9; i < 40; ++i) frame.payload[i] = 0xAB;
  MavlinkParser parser;
  const auto frames = parse_all(parser, wire_bytes(frame));
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(payload_of(*read_mavlink_message<MavHeartbeat>(frames[0])), payload_of(sent));
}

TEST(MavlinkFrame, AMessageIsReadAsItselfOnly) {
  const auto frame = make_mavlink_frame(MavHeartbeat{}, {}, 0);
  EXPECT_FALSE(read_mavlink_message<MavAttitude>(frame));
  MavlinkFrame unknown = frame;
  unknown.message = 4242;
  MavlinkBytes bytes{};
  EXPECT_EQ(write_mavlink_frame(unknown, bytes), 0U);
}

}  // namespace
}  // namespace hm
