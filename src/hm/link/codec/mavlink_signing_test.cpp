#include "hm/link/codec/mavlink_signing.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "hm/link/codec/mavlink_parser.hpp"
#include "hm/link/testing/random_messages.hpp"

namespace hm {
namespace {

using link_testing::parse_all;
using link_testing::wire_bytes;

constexpr MavlinkKey kKey{1, 2, 3, 4, 5, 6, 7, 8};
constexpr std::uint64_t kStart = 1'000'000'000;

std::vector<std::uint8_t> signed_heartbeat(MavlinkSigner& signer, MavlinkAddress from = {1, 1}) {
  return wire_bytes(make_mavlink_frame(MavHeartbeat{}, from, 0), &signer);
}

TEST(MavlinkSigning, SignedFramesAreAccepted) {
  MavlinkSigner signer(kKey, 3);
  signer.set_ticks(kStart);
  MavlinkVerifier verifier(kKey);
  MavlinkParser parser(&verifier);
  for (int i = 0; i < 5; ++i) {
    const auto frames = parse_all(parser, signed_heartbeat(signer));
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_TRUE(frames[0].is_signed);
  }
  EXPECT_EQ(signer.ticks(), kStart + 5);
  // One who does not check reads signed frames too.
  MavlinkParser open;
  EXPECT_EQ(parse_all(open, signed_heartbeat(signer)).size(), 1U);
}

TEST(MavlinkSigning, RepeatedAndOlderFramesAreRefused) {
  MavlinkSigner signer(kKey, 3);
  signer.set_ticks(kStart);
  MavlinkVerifier verifier(kKey);
  MavlinkParser parser(&verifier);
  const auto first = signed_heartbeat(signer), second = signed_heartbeat(signer);
  EXPECT_EQ(parse_all(parser, second).size(), 1U);
  EXPECT_EQ(parse_all(parser, second).size(), 0U);
  EXPECT_EQ(parse_all(parser, first).size(), 0U);
  EXPECT_EQ(parser.counts().replayed, 2U);
}

TEST(MavlinkSigning, ANewStreamMayBeAMinuteOldAndNoMore) {
  MavlinkVerifier verifier(kKey);
  verifier.set_ticks(kStart + MavlinkVerifier::kMaxAgeTicks);
  MavlinkParser parser(&verifier);
  MavlinkSigner fresh(kKey, 1), stale(kKey, 2);
  fresh.set_ticks(kStart);
  stale.set_ticks(kStart - 1);
  EXPECT_EQ(parse_all(parser, signed_heartbeat(stale)).size(), 0U);
  EXPECT_EQ(parse_all(parser, signed_heartbeat(fresh)).size(), 1U);
}

TEST(MavlinkSigning, WrongKeysMissingSignaturesAndChangedBitsAreRefused) {
  MavlinkKey other = kKey;
  other[31] = 1;
  MavlinkSigner signer(other, 3), right(kKey, 3);
  MavlinkVerifier verifier(kKey);
  MavlinkParser parser(&verifier);
  EXPECT_EQ(parse_all(parser, signed_heartbeat(signer)).size(), 0U);
  EXPECT_EQ(parser.counts().bad_signature, 1U);
  EXPECT_EQ(parse_all(parser, wire_bytes(make_mavlink_frame(MavHeartbeat{}, {}, 0))).size(), 0U);
  EXPECT_EQ(parser.counts().not_signed, 1U);
  const auto good = signed_heartbeat(right);
  const std::size_t signature_at = good.size() - kMavlinkSignatureBytes;
  for (std::size_t bit = 8 * signature_at; bit < 8 * good.size(); ++bit) {
    auto bad = good;
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1U << (bit % 8)));
    EXPECT_EQ(parse_all(parser, bad).size(), 0U) << bit;
  }
  EXPECT_EQ(parse_all(parser, good).size(), 1U);
}

TEST(MavlinkSigning, MoreSendersThanThereIsRoomForAreRefused) {
  MavlinkSigner signer(kKey, 3);
  MavlinkVerifier verifier(kKey);
  MavlinkParser parser(&verifier);
  for (std::uint8_t i = 0; i < MavlinkVerifier::kMaxStreams; ++i)
    EXPECT_EQ(parse_all(parser, signed_heartbeat(signer, {i, 1})).size(), 1U);
  EXPECT_EQ(parse_all(parser, signed_heartbeat(signer, {100, 1})).size(), 0U);
  EXPECT_EQ(parse_all(parser, signed_heartbeat(signer, {0, 1})).size(), 1U);
}

}  // namespace
}  // namespace hm
