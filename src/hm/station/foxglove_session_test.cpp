#include "hm/station/foxglove_session.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/station/live_frames.hpp"

namespace hm {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Optional;

constexpr Duration milliseconds_of(std::int64_t milliseconds) { return {milliseconds * 1'000'000}; }

struct Received {
  std::uint32_t subscription = 0;
  std::int64_t stamp_ns = 0;
  JsonValue value;
};

/// Number at a path of member names and indices, "poses/1/position/x".
double number_at(const JsonValue& value, const std::string& path) {
  const auto slash = path.find('/');
  const std::string name = path.substr(0, slash);
  const JsonValue* member = value.as_array() ? &value.as_array()->at(std::stoul(name)) : value.find(name);
  if (!member) return std::nan("");
  return slash == std::string::npos ? member->number_or(std::nan(""))
                                    : number_at(*member, path.substr(slash + 1));
}

class FoxgloveTest : public testing::Test {
 protected:
  /// Everything that the session has to say now: texts, and data decoded.
  void drain() {
    texts.clear();
    received.clear();
    while (true) {
      const WebOutput output = session.next(now);
      const auto* message = std::get_if<WebMessage>(&output);
      if (!message) return;
      std::string bytes(bytes_text(message->head));
      if (message->body) bytes += bytes_text(*message->body);
      if (message->text) {
        texts.push_back(bytes);
        continue;
      }
      ASSERT_GT(bytes.size(), 13u);
      EXPECT_EQ(bytes[0], 1);
      Received one;
      std::memcpy(&one.subscription, bytes.data() + 1, 4);
      std::memcpy(&one.stamp_ns, bytes.data() + 5, 8);
      one.value = *parse_json(std::string_view(bytes).substr(13), "data");
      received.push_back(one);
    }
  }
  std::optional<WebClose> say(const std::string& text, bool is_text = true) {
    const WebOutput output = session.receive(text, is_text, now);
    const auto* end = std::get_if<WebClose>(&output);
    return end ? std::optional(*end) : std::nullopt;
  }
  void subscribe(std::uint32_t id, FoxgloveChannel channel) {
    EXPECT_FALSE(say(fmt::format(R"({{"op":"subscribe","subscriptions":[{{"id":{},"channelId":{}}}]}})", id,
                                 static_cast<int>(channel))));
  }
  void put_pose(PoseFrame::Which which, Time stamp, const Vec3& position) {
    PoseFrame pose;
    pose.which = which;
    pose.position_m = position;
    pose.orientation = Eigen::AngleAxisf(float(M_PI) / 2, Eigen::Vector3f::UnitZ());
    store.put(LiveKind::kPose, static_cast<std::uint64_t>(which), stamp, to_payload(pose));
  }

  LiveStore store;
  FoxgloveSession session{store};
  Duration now;
  std::vector<std::string> texts;
  std::vector<Received> received;
};

TEST(FoxgloveProtocol, EitherSubprotocolIsTaken) {
  EXPECT_THAT(foxglove_protocol({"x", "foxglove.websocket.v1"}),
              Optional(std::string("foxglove.websocket.v1")));
  EXPECT_THAT(foxglove_protocol({"foxglove.websocket.v1", "foxglove.sdk.v1"}),
              Optional(std::string("foxglove.sdk.v1")));
  EXPECT_FALSE(foxglove_protocol({"foxglove.websocket.v2"}));
  EXPECT_FALSE(foxglove_protocol({}));
}

TEST_F(FoxgloveTest, SaysWhoItIsAndAdvertisesEveryChannelWithItsSchema) {
  drain();
  ASSERT_EQ(texts.size(), 2u);
  EXPECT_THAT(texts[0], HasSubstr(R"("op":"serverInfo","name":"housemartin","capabilities":[])"));
  const auto advertise = parse_json(texts[1], "advertise");
  const auto& channels = *advertise->find("channels")->as_array();
  ASSERT_EQ(channels.size(), kFoxgloveChannels.size());
  for (const auto& channel : channels) {
    const auto schema = parse_json(*channel.find("schema")->as_string(), "schema");
    ASSERT_TRUE(schema);
    EXPECT_TRUE(schema->find("properties"));
  }
}

TEST_F(FoxgloveTest, SendsOnlyWhatIsSubscribedAndOnlyTheNewest) {
  put_pose(PoseFrame::Which::kCamera, Time{5}, {1, 2, 3});
  drain();
  EXPECT_TRUE(received.empty());
  subscribe(7, FoxgloveChannel::kCameraPose);
  drain();
  ASSERT_EQ(received.size(), 1u);
  EXPECT_EQ(received[0].subscription, 7u);
  EXPECT_EQ(received[0].stamp_ns, 5);
  EXPECT_EQ(number_at(received[0].value, "pose/position/y"), 2);
  EXPECT_NEAR(number_at(received[0].value, "pose/orientation/z"), std::sqrt(0.5), 1e-6);
  for (int i = 0; i < 10; ++i) put_pose(PoseFrame::Which::kCamera, Time{10 + i}, Vec3(i, 0, 0));
  drain();
  ASSERT_EQ(received.size(), 1u);
  EXPECT_EQ(received[0].stamp_ns, 19);
  EXPECT_FALSE(say(R"({"op":"unsubscribe","subscriptionIds":[7]})"));
  put_pose(PoseFrame::Which::kCamera, Time{50}, {0, 0, 0});
  drain();
  EXPECT_TRUE(received.empty());
}

TEST_F(FoxgloveTest, EachSubscriptionToAChannelGetsItsCopy) {
  drain();
  subscribe(1, FoxgloveChannel::kTransforms);
  subscribe(2, FoxgloveChannel::kTransforms);
  put_pose(PoseFrame::Which::kCamera, Time{5}, {1, 2, 3});
  put_pose(PoseFrame::Which::kVehicle, Time{9}, {4, 5, 6});
  drain();
  ASSERT_EQ(received.size(), 2u);
  EXPECT_EQ(received[0].subscription, 1u);
  EXPECT_EQ(received[1].subscription, 2u);
  EXPECT_EQ(received[1].stamp_ns, 9);
  EXPECT_EQ(number_at(received[1].value, "transforms/1/translation/x"), 4);
  EXPECT_EQ(number_at(received[1].value, "transforms/0/timestamp/nsec"), 5);
}

TEST_F(FoxgloveTest, PathsAreJoinedFromTheirPieces) {
  drain();
  subscribe(1, FoxgloveChannel::kTrajectory);
  store.put(LiveKind::kPath, 11, Time{2},
            to_payload(PathFrame{PathFrame::Which::kTrajectory, 2, 3, {{2, 0, 0}, {3, 0, 0}}}));
  store.put(LiveKind::kPath, 10, Time{1},
            to_payload(PathFrame{PathFrame::Which::kTrajectory, 0, 2, {{0, 0, 0}, {1, 0, 0}}}));
  store.put(LiveKind::kPath, 12, Time{3},
            to_payload(PathFrame{PathFrame::Which::kKeyframes, 0, 1, {{9, 9, 9}}}));
  drain();
  ASSERT_EQ(received.size(), 1u);
  ASSERT_EQ(received[0].value.find("poses")->as_array()->size(), 3u);  // the newest total
  EXPECT_EQ(number_at(received[0].value, "poses/2/position/x"), 2);
  // At most once a second, and never left out for good.
  store.put(LiveKind::kPath, 11, Time{4},
            to_payload(PathFrame{PathFrame::Which::kTrajectory, 2, 4, {{2, 0, 0}, {3, 0, 0}}}));
  now = milliseconds_of(500);
  drain();
  EXPECT_TRUE(received.empty());
  now = milliseconds_of(1000);
  drain();
  ASSERT_EQ(received.size(), 1u);
  EXPECT_EQ(received[0].value.find("poses")->as_array()->size(), 4u);
}

TEST_F(FoxgloveTest, AScanIsRangesAboutTheVehicleAndACloud) {
  drain();
  subscribe(1, FoxgloveChannel::kLaserScan);
  subscribe(2, FoxgloveChannel::kLaserPoints);
  subscribe(3, FoxgloveChannel::kObstacles);
  put_pose(PoseFrame::Which::kVehicle, Time{1}, {1, 1, 1});  // looks along +y
  store.put(LiveKind::kScan, 0, Time{2},
            to_payload(ScanFrame{ScanFrame::Which::kLaser, {{1.01f, 3, 1}, {1.01f, 4, 1}, {-2, 1.02f, 1}}}));
  drain();
  ASSERT_EQ(received.size(), 2u);
  const JsonValue& scan = received[0].value;
  EXPECT_EQ(number_at(scan, "pose/position/x"), 1);
  const auto& ranges = *scan.find("ranges")->as_array();
  ASSERT_EQ(ranges.size(), 720u);
  EXPECT_NEAR(ranges[359].number_or(0), 2, 1e-3);  // just right of ahead, the nearer of two
  EXPECT_NEAR(ranges[539].number_or(0), 3, 1e-3);  // just right of the left
  double sum = 0;
  for (const auto& range : ranges) sum += range.number_or(-1);
  EXPECT_NEAR(sum, 5, 1e-3);
  // 1.01, 3, 1 as floats in base64
  const std::string data = *received[1].value.find("data")->as_string();
  EXPECT_EQ(data.substr(0, 16), "rkeBPwAAQEAAAIA/");
  EXPECT_EQ(data.size(), 48u);
  EXPECT_EQ(number_at(received[1].value, "fields/2/offset"), 8);
}

TEST_F(FoxgloveTest, EventsAreALog) {
  store.add_event(Time::from_seconds(1.5), "warning", "too fast");
  drain();
  subscribe(1, FoxgloveChannel::kLog);
  drain();
  store.add_event(Time::from_seconds(2), "error", "lost");
  store.add_event(Time::from_seconds(2), "info", "found");
  const auto before = received;
  ASSERT_EQ(before.size(), 1u);
  EXPECT_EQ(number_at(before[0].value, "level"), 3);
  EXPECT_EQ(number_at(before[0].value, "timestamp/nsec"), 500'000'000);
  drain();
  ASSERT_EQ(received.size(), 2u);
  EXPECT_EQ(number_at(received[0].value, "level"), 4);
  EXPECT_EQ(number_at(received[1].value, "level"), 2);
}

TEST_F(FoxgloveTest, WhatIsWrongIsSaidOrEndsTheConnection) {
  drain();
  EXPECT_FALSE(say(R"({"op":"getParameters"})"));
  EXPECT_FALSE(say(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":99}]})"));
  drain();
  ASSERT_EQ(texts.size(), 2u);
  EXPECT_THAT(texts[0], HasSubstr("'getParameters' is not served"));
  EXPECT_THAT(texts[1], HasSubstr("subscription 1 to channel 99 is refused"));
  EXPECT_EQ(say("\x01 data", false)->code, WebClose::kData);
  const std::string whole = R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":2}]})";
  for (std::size_t size = 0; size < whole.size(); ++size) EXPECT_TRUE(say(whole.substr(0, size))) << size;
  for (const char* text :
       {R"({"op":1})", R"({"op":"subscribe"})", R"({"op":"subscribe","subscriptions":[1]})",
        R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
        R"({"op":"unsubscribe","subscriptionIds":["1"]})"})
    EXPECT_TRUE(say(text)) << text;
  Rng rng(1);
  for (int round = 0; round < 5000; ++round) {
    std::string text = whole;
    for (int k = 0; k < 2; ++k)
      text[rng.below(static_cast<std::uint32_t>(text.size()))] = static_cast<char>(rng.below(256));
    say(text);
  }
  put_pose(PoseFrame::Which::kCamera, Time{5}, {1, 2, 3});
  drain();
  EXPECT_LE(received.size(), FoxgloveSession::kMaxSubscriptions);
}

}  // namespace
}  // namespace hm
