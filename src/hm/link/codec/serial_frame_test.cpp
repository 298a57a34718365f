#include "hm/link/codec/serial_frame.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "hm/link/testing/random_messages.hpp"

namespace hm {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes serial_wire(const SerialFrame& frame) {
  SerialBytes bytes{};
  const std::size_t count = write_serial_frame(frame, bytes);
  return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count)};
}

std::string hex_text(const Bytes& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes)
    for (const unsigned digit : {byte / 16U, byte % 16U}) text += "0123456789abcdef"[digit];
  return text;
}

std::vector<SerialFrame> parse_serial(SerialParser& parser, std::span<const std::uint8_t> bytes) {
  std::vector<SerialFrame> frames;
  parser.parse(bytes, [&](const SerialFrame& frame) { frames.push_back(frame); });
  return frames;
}

std::vector<SerialDirection> directions_of(SerialDirection direction) {
  if (direction == SerialDirection::kBoth) return {SerialDirection::kUp, SerialDirection::kDown};
  return {direction};
}

/// A random frame of each packet and direction.
std::vector<SerialFrame> every_serial_frame(Rng& rng) {
  std::vector<SerialFrame> frames;
  SerialPackets::for_each([&]<class Packet>() {
    for (const SerialDirection direction : directions_of(Packet::kDirection))
      frames.push_back(make_serial_frame(
          link_testing::random_message<Packet>(rng), direction,
          direction == SerialDirection::kUp ? static_cast<std::uint8_t>(rng.next_u32()) : std::uint8_t{0}));
  });
  return frames;
}

// Measured with the author's implementation (laser MAV, section (i)).
TEST(SerialFrame, GivesTheBytesOfTheAuthorsFirmware) {
  EXPECT_EQ(hex_text(serial_wire(make_serial_frame(SerialFlightAction{3}, SerialDirection::kUp))),
            "3e2a3e01080003aa32");
  EXPECT_EQ(hex_text(serial_wire(make_serial_frame(SerialFlightState{5}, SerialDirection::kDown))),
            "ff09010905757f");
  EXPECT_EQ(hex_text(serial_wire(make_serial_frame(SerialHeight{1, 0}, SerialDirection::kUp))),
            "3e2a3e0806000000803f00000000eb73");
}

TEST(SerialFrame, EveryPacketWithRandomFieldsComesBack) {
  Rng rng(1);
  for (int round = 0; round < 100; ++round)
    for (const SerialFrame& sent : every_serial_frame(rng)) {
      SerialParser parser(sent.direction);
      const auto frames = parse_serial(parser, serial_wire(sent));
      ASSERT_EQ(frames.size(), 1U) << int{sent.type};
      EXPECT_EQ(frames[0].type, sent.type);
      EXPECT_EQ(frames[0].flag, sent.flag);
      EXPECT_EQ(frames[0].payload, sent.payload);
    }
  SerialPackets::for_each([&]<class Packet>() {
    const auto packet = link_testing::random_message<Packet>(rng);
    const auto frame = make_serial_frame(packet, SerialDirection::kUp);
    const auto again = make_serial_frame(*read_serial_packet<Packet>(frame), SerialDirection::kUp);
    EXPECT_EQ(frame.payload, again.payload) << int{Packet::kType};
  });
}

TEST(SerialFrame, PacketsGoTheirOwnWayOnly) {
  EXPECT_TRUE(serial_wire(make_serial_frame(SerialPose{}, SerialDirection::kUp)).empty());
  EXPECT_TRUE(serial_wire(make_serial_frame(SerialHeight{}, SerialDirection::kDown)).empty());
  SerialFrame unknown;
  unknown.type = 0x13;
  EXPECT_TRUE(serial_wire(unknown).empty());
}

TEST(SerialFrame, EveryPrefixWaitsAndTheRestCompletesIt) {
  Rng rng(2);
  for (const SerialFrame& sent : every_serial_frame(rng)) {
    const Bytes bytes = serial_wire(sent);
    for (std::size_t cut = 0; cut < bytes.size(); ++cut) {
      SerialParser parser(sent.direction);
      ASSERT_TRUE(parse_serial(parser, std::span(bytes).first(cut)).empty());
      ASSERT_EQ(parse_serial(parser, std::span(bytes).subspan(cut)).size(), 1U)
          << int{sent.type} << ' ' << cut;
    }
  }
}

// The size byte too, which the checksum does not protect.
TEST(SerialFrame, NoFrameWithOneWrongBitIsAccepted) {
  Rng rng(3);
  for (const SerialFrame& sent : every_serial_frame(rng)) {
    const Bytes good = serial_wire(sent);
    for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
      Bytes bad = good;
      bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1U << (bit % 8)));
      SerialParser parser(sent.direction);
      ASSERT_TRUE(parse_serial(parser, bad).empty()) << int{sent.type} << " bit " << bit;
    }
  }
}

TEST(SerialFrame, ADamagedSizeLosesOneFrameOnly) {
  const Bytes good = serial_wire(make_serial_frame(SerialHeight{1, 2}, SerialDirection::kUp));
  for (int size = 0; size < 256; ++size) {
    Bytes damaged = good;
    damaged[3] = static_cast<std::uint8_t>(size);
    SerialParser parser(SerialDirection::kUp);
    const bool right = size == 8;
    EXPECT_EQ(parse_serial(parser, damaged).size(), right ? 1U : 0U) << size;
    EXPECT_EQ(parse_serial(parser, good).size(), 1U) << size;
    EXPECT_EQ(parser.counts().wrong_size, right ? 0U : 1U);
  }
}

TEST(SerialFrame, ResynchronisesWithinTwoFrames) {
  Rng rng(4);
  for (int round = 0; round < 3000; ++round) {
    Bytes noise(rng.below(200));
    for (auto& byte : noise) {
      constexpr std::array<std::uint8_t, 4> kLikely{0xFF, 0x09, 0x01, 0x0D};
      byte = rng.below(4) == 0 ? kLikely[rng.below(4)] : static_cast<std::uint8_t>(rng.next_u32());
    }
    SerialParser parser(SerialDirection::kDown);
    std::size_t accepted = parse_serial(parser, noise).size();
    const std::size_t chance = accepted;  // 2^-16 of what looks like a frame
    for (std::size_t n = 1; n <= 3; ++n) {
      const Bytes frame = serial_wire(
          make_serial_frame(link_testing::random_message<SerialImu>(rng), SerialDirection::kDown));
      accepted += parse_serial(parser, frame).size();
      if (n >= 2) {
        ASSERT_GE(accepted, n - 1 + chance) << round;
      }
    }
  }
}

TEST(SerialFrame, AfterASilenceWhatIsIncompleteIsGivenUp) {
  const Bytes good = serial_wire(make_serial_frame(SerialImu{}, SerialDirection::kDown));
  SerialParser parser(SerialDirection::kDown);
  const Bytes start{0xFF, 0x09, 114, 0x12};  // the largest, of which nothing else comes
  EXPECT_TRUE(parse_serial(parser, start).empty());
  parser.give_up_incomplete();
  EXPECT_FALSE(parser.next());
  EXPECT_EQ(parse_serial(parser, good).size(), 1U);
  EXPECT_EQ(parser.counts().cut_off, 1U);
}

}  // namespace
}  // namespace hm
