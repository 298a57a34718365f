#include "hm/link/codec/mavlink_parser.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "hm/link/codec/crc16.hpp"
#include "hm/link/testing/random_messages.hpp"

namespace hm {
namespace {

using link_testing::parse_all;
using link_testing::random_frame;
using link_testing::wire_bytes;
using Bytes = std::vector<std::uint8_t>;

Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// A frame of MAVLink 1 or 2 with any message number and checksum.
Bytes foreign_frame(std::uint8_t start, std::uint32_t message, std::size_t length, std::uint8_t crc_extra) {
  Bytes bytes = start == kMavlink1Start ? Bytes{start, static_cast<std::uint8_t>(length), 0, 1,
                                                1,     static_cast<std::uint8_t>(message)}
                                        : Bytes{start,
                                                static_cast<std::uint8_t>(length),
                                                0,
                                                0,
                                                0,
                                                1,
                                                1,
                                                static_cast<std::uint8_t>(message),
                                                static_cast<std::uint8_t>(message >> 8U),
                                                0};
  for (std::size_t i = 0; i < length; ++i) bytes.push_back(static_cast<std::uint8_t>(7 * i + 1));
  Crc16 crc(0xFFFF);
  crc.add(std::span(bytes).subspan(1));
  crc.add(crc_extra);
  bytes.push_back(static_cast<std::uint8_t>(crc.value() & 0xFFU));
  bytes.push_back(static_cast<std::uint8_t>(crc.value() >> 8U));
  return bytes;
}

TEST(MavlinkParser, EveryPrefixWaitsAndTheRestCompletesIt) {
  Rng rng(1);
  for (std::size_t n = 0; n < MavlinkMessages::kCount; ++n) {
    const Bytes bytes = wire_bytes(random_frame(n, rng));
    for (std::size_t cut = 0; cut < bytes.size(); ++cut) {
      MavlinkParser parser;
      ASSERT_TRUE(parse_all(parser, std::span(bytes).first(cut)).empty()) << n << ' ' << cut;
      ASSERT_EQ(parse_all(parser, std::span(bytes).subspan(cut)).size(), 1U) << n << ' ' << cut;
    }
  }
}

TEST(MavlinkParser, NoFrameWithOneWrongBitIsAccepted) {
  Rng rng(2);
  for (std::size_t n = 0; n < MavlinkMessages::kCount; ++n) {
    const Bytes good = wire_bytes(random_frame(n, rng));
    for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
      Bytes bad = good;
      bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1U << (bit % 8)));
      MavlinkParser parser;
      ASSERT_TRUE(parse_all(parser, bad).empty()) << n << " bit " << bit;
      while (parser.next_at_end()) FAIL() << n << " bit " << bit;
    }
  }
}

// Of 1e5 frames with 1 to 8 wrong bytes in random places the checksum lets 1.5 pass on average; 8 or more
// would happen once in 4,000 seeds.
TEST(MavlinkParser, DamagedFramesAreAcceptedByChanceOfTheChecksumOnly) {
  Rng rng(3);
  int accepted = 0;
  for (std::size_t n = 0; n < 100'000; ++n) {
    Bytes bytes = wire_bytes(random_frame(n, rng));
    const Bytes good = bytes;
    for (std::uint32_t k = 1 + rng.below(8); k > 0; --k)
      bytes[rng.below(static_cast<std::uint32_t>(bytes.size()))] = static_cast<std::uint8_t>(rng.next_u32());
    if (bytes == good) continue;
    MavlinkParser parser;
    accepted += static_cast<int>(parse_all(parser, bytes).size());
    while (parser.next_at_end()) ++accepted;
  }
  EXPECT_LT(accepted, 8);
}

// Noise full of start bytes, then good frames: at the latest the second brings one, and at most one is lost.
TEST(MavlinkParser, ResynchronisesWithinTwoFrames) {
  int lost = 0;
  Rng rng(4);
  for (int round = 0; round < 3000; ++round) {
    Bytes noise(rng.below(300));
    for (auto& byte : noise) {
      byte = static_cast<std::uint8_t>(rng.next_u32());
      if (rng.below(8) == 0) byte = rng.below(2) ? kMavlink2Start : kMavlink1Start;
    }
    MavlinkParser parser;
    std::size_t arrived = parse_all(parser, noise).size();
    ASSERT_EQ(arrived, 0U);
    for (std::size_t n = 1; n <= 4; ++n) {
      arrived += parse_all(parser, wire_bytes(random_frame(round + n, rng))).size();
      if (n >= 2) {
        ASSERT_GE(arrived, n - 1) << "round " << round;
      }
    }
    lost += arrived < 4;
  }
  EXPECT_LT(lost, 30);  // one in a hundred
}

// The length of a frame is damaged so that it reaches over the short frames behind it.
TEST(MavlinkParser, ADamagedLengthHoldsUpAtMostTwoFrames) {
  Bytes damaged = wire_bytes(make_mavlink_frame(MavHeartbeat{}, {}, 0));
  damaged[1] = 255;
  MavlinkParser parser;
  EXPECT_EQ(parse_all(parser, damaged).size(), 0U);
  const Bytes good = wire_bytes(make_mavlink_frame(MavHeartbeat{}, {}, 1));
  EXPECT_EQ(parse_all(parser, good).size(), 0U);
  EXPECT_EQ(parse_all(parser, good).size(), 2U);
  EXPECT_EQ(parser.counts().cut_off, 1U);
  EXPECT_EQ(parser.counts().skipped_bytes, damaged.size());
}

// A frame in the payload of another one (a log that is downloaded) is no frame of the stream.
TEST(MavlinkParser, AFrameInsideAPayloadIsNotAccepted) {
  const Bytes inner = wire_bytes(make_mavlink_frame(MavHeartbeat{}, {9, 9}, 0));
  MavlinkFrame outer = make_mavlink_frame(MavStatusText{}, {}, 0);
  std::copy(inner.begin(), inner.end(), outer.payload.begin() + 1);
  outer.length = static_cast<std::uint8_t>(1 + inner.size());
  MavlinkParser parser;
  const auto bytes = wire_bytes(outer);
  std::vector<MavlinkFrame> frames;
  for (const std::uint8_t byte : bytes)
    parser.parse({&byte, 1}, [&](const MavlinkFrame& frame) { frames.push_back(frame); });
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].message, MavStatusText::kId);
}

TEST(MavlinkParser, CountsWhatItRefusesByReason) {
  const Bytes good = wire_bytes(make_mavlink_frame(MavHeartbeat{}, {}, 0));
  Bytes incompatible = good, bad_crc = good;
  incompatible[2] = 2;
  bad_crc.back() ^= 1U;
  const Bytes old = foreign_frame(kMavlink1Start, MavHeartbeat::kId, 9, 50);
  const Bytes old_unknown = foreign_frame(kMavlink1Start, 200, 12, 3);
  const Bytes unknown = foreign_frame(kMavlink2Start, 12'900, 60, 17);
  MavlinkParser parser;
  EXPECT_EQ(parse_all(parser, good + incompatible + good + bad_crc + good + old + good + old_unknown + good +
                                  unknown + good)
                .size(),
            6U);
  EXPECT_EQ(parser.counts().frames, 6U);
  EXPECT_EQ(parser.counts().incompatible, 1U);
  EXPECT_EQ(parser.counts().bad_crc, 1U);
  EXPECT_EQ(parser.counts().mavlink1, 2U);
  EXPECT_EQ(parser.counts().unknown_message, 1U);
  EXPECT_EQ(parser.counts().skipped_bytes, incompatible.size() + bad_crc.size());
}

TEST(MavlinkParser, AtTheEndOfADatagramNothingIsLeft) {
  const Bytes good = wire_bytes(make_mavlink_frame(MavHeartbeat{}, {}, 0));
  const Bytes unknown = foreign_frame(kMavlink2Start, 12'900, 60, 17);
  MavlinkParser parser;
  EXPECT_EQ(parse_all(parser, unknown + unknown).size(), 0U);
  EXPECT_FALSE(parser.next_at_end());
  EXPECT_EQ(parser.counts().unknown_message, 2U);
  EXPECT_EQ(parser.counts().skipped_bytes, 0U);
  Bytes half(good.begin(), good.begin() + 12);
  EXPECT_EQ(parse_all(parser, half).size(), 0U);
  EXPECT_FALSE(parser.next_at_end());
  EXPECT_EQ(parser.counts().cut_off, 1U);
  EXPECT_EQ(parse_all(parser, good).size(), 1U);
}

}  // namespace
}  // namespace hm
