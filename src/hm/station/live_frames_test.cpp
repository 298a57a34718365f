#include "hm/station/live_frames.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

struct KindAndFrame {
  LiveKind kind;
  LiveFrame frame;
};

std::vector<std::byte> bytes_of(std::size_t count, unsigned first) {
  std::vector<std::byte> bytes(count);
  for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<std::byte>(first + i);
  return bytes;
}

std::vector<KindAndFrame> one_of_each() {
  const std::vector<Eigen::Vector3f> points{{1, 2, 3}, {-4.5f, 0, 1e9f}};
  MeshPageFrame page{{-1, 2, -3},     77, 2, true, 5, 6, {0.5f, -0.5f, 2}, 0.001f, 1.5f, bytes_of(9, 1),
                     bytes_of(4, 100)};
  PoseFrame pose{PoseFrame::Which::kVehicle,
                 PoseFrame::State::kEstimated,
                 0.25f,
                 {1, -2, 3},
                 {0.5f, -0.5f, 0.5f, 0.5f},
                 0.5f,
                 0.4f};
  GridTileFrame tile{-7, 8, 9, 0.05f, 1.2f, 3, {0, 1, 2, 3, 4, 5, 6, 254, 255}};
  return {{LiveKind::kHello, JsonFrame{R"({"protocol":1})"}},
          {LiveKind::kMeshPage, page},
          {LiveKind::kPageGone, PageGoneFrame{{4, -5, 6}, 78}},
          {LiveKind::kPose, pose},
          {LiveKind::kPath, PathFrame{PathFrame::Which::kWayPoints, 10, 12, points}},
          {LiveKind::kScan, ScanFrame{ScanFrame::Which::kObstacles, points}},
          {LiveKind::kPlan, PlanFrame{PlanFrame::State::kRefused, "through a wall", points}},
          {LiveKind::kGridTile, tile},
          {LiveKind::kTelemetry, JsonFrame{"{}"}},
          {LiveKind::kEvent, JsonFrame{R"({"id":1})"}},
          {LiveKind::kPicture,
           PictureFrame{PictureFrame::Which::kDepth, PictureFrame::Format::kPng, 640, 480, bytes_of(7, 3)}},
          {LiveKind::kStatistics, JsonFrame{""}}};
}

std::vector<std::byte> message_of(const KindAndFrame& one) {
  auto message = live_header(one.kind, 0x01020304, Time{-5});
  const auto payload = to_payload(one.frame);
  message.insert(message.end(), payload.begin(), payload.end());
  return message;
}

TEST(LiveFrames, EveryKindComesBackTheSame) {
  for (const auto& one : one_of_each()) {
    SCOPED_TRACE(static_cast<int>(one.kind));
    const auto decoded = decode_live_message(message_of(one));
    ASSERT_TRUE(decoded) << to_string(decoded.error());
    EXPECT_EQ(decoded->kind, one.kind);
    EXPECT_EQ(decoded->sequence, 0x01020304u);
    EXPECT_EQ(decoded->stamp, Time{-5});
    EXPECT_EQ(decoded->frame.index(), one.frame.index());
    EXPECT_EQ(to_payload(decoded->frame), to_payload(one.frame));
  }
}

TEST(LiveFrames, LayoutIsThatOfTheDocument) {
  const auto message = message_of(one_of_each()[3]);  // a pose
  ASSERT_EQ(message.size(), 16u + 4 + 4 + 24 + 16 + 8);
  const auto* bytes = reinterpret_cast<const unsigned char*>(message.data());
  EXPECT_EQ(std::vector<int>(bytes, bytes + 8), (std::vector<int>{1, 4, 0, 0, 4, 3, 2, 1}));
  EXPECT_EQ(bytes[16], 1);
  EXPECT_EQ(bytes[17], 2);
  double y = 0;
  std::memcpy(&y, bytes + 16 + 8 + 8, sizeof(y));
  EXPECT_EQ(y, -2);
  float w = 0;
  std::memcpy(&w, bytes + 16 + 8 + 24 + 12, sizeof(w));
  EXPECT_EQ(w, 0.5f);
  const auto page = message_of(one_of_each()[1]);
  float age_s = 0;
  std::memcpy(&age_s, page.data() + kLiveHeaderBytes + kMeshPageAgeOffset, sizeof(age_s));
  EXPECT_EQ(age_s, 1.5f);
  EXPECT_EQ(page.size(), 16u + 56 + 9 + 4);
}

TEST(LiveFrames, EveryPrefixOfACountedPayloadIsRefused) {
  for (const auto& one : one_of_each()) {
    const bool open_ended =
        std::holds_alternative<JsonFrame>(one.frame) || std::holds_alternative<PictureFrame>(one.frame);
    const auto message = message_of(one);
    for (std::size_t size = 0; size < message.size(); ++size) {
      const auto decoded = decode_live_message(std::span(message).first(size));
      if (!open_ended || size < kLiveHeaderBytes) {
        EXPECT_FALSE(decoded) << static_cast<int>(one.kind) << " " << size;
      }
    }
    auto longer = message;
    longer.push_back(std::byte{0});
    EXPECT_EQ(decode_live_message(longer).has_value(), open_ended);
  }
}

TEST(LiveFrames, DamageIsRefusedOrGivesAFrameOfTheSameSize) {
  Rng rng(5);
  for (const auto& one : one_of_each()) {
    const auto whole = message_of(one);
    for (int round = 0; round < 2000; ++round) {
      auto message = whole;
      for (int k = 0; k < 3; ++k)
        message[rng.below(static_cast<std::uint32_t>(message.size()))] =
            static_cast<std::byte>(rng.below(256));
      const auto decoded = decode_live_message(message);
      if (decoded) {
        EXPECT_EQ(to_payload(decoded->frame).size() + kLiveHeaderBytes, message.size());
      }
    }
  }
}

TEST(LiveFrames, OtherVersionsKindsAndFlagsAreRefused) {
  auto message = message_of(one_of_each()[3]);
  message[0] = std::byte{2};
  EXPECT_EQ(decode_live_message(message).error().code, ErrorCode::kUnsupported);
  message[0] = std::byte{1};
  message[1] = std::byte{13};
  EXPECT_EQ(decode_live_message(message).error().code, ErrorCode::kUnsupported);
  message[1] = std::byte{4};
  message[2] = std::byte{1};
  EXPECT_EQ(decode_live_message(message).error().code, ErrorCode::kCorrupted);
  auto page = message_of(one_of_each()[1]);
  EXPECT_TRUE(decode_live_message(page));
  page[kLiveHeaderBytes + 16] = std::byte{3};  // a fourth level
  EXPECT_EQ(decode_live_message(page).error().code, ErrorCode::kCorrupted);
}

}  // namespace
}  // namespace hm
