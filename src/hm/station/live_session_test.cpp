#include "hm/station/live_session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/station/live_frames.hpp"

namespace hm {
namespace {

using testing::HasSubstr;

class LiveSessionTest : public testing::Test {
 protected:
  std::optional<WebClose> say(const std::string& text, bool is_text = true) {
    const WebOutput output = session.receive(text, is_text, now);
    const auto* end = std::get_if<WebClose>(&output);
    return end ? std::optional(*end) : std::nullopt;
  }
  /// The next frame, if there is one.
  std::optional<LiveMessage> next() {
    const WebOutput output = session.next(now);
    const auto* message = std::get_if<WebMessage>(&output);
    if (!message) return std::nullopt;
    auto bytes = message->head;
    if (message->body)
      bytes.insert(bytes.end(), message->body->begin() + static_cast<std::ptrdiff_t>(message->body_offset),
                   message->body->end());
    auto decoded = decode_live_message(bytes);
    EXPECT_TRUE(decoded) << to_string(decoded.error());
    return std::move(*decoded);
  }
  void put_page(PageKey key, std::uint32_t version) {
    MeshPageFrame frame;
    frame.key = key;
    frame.version = version;
    frame.age_s = 100;
    frame.vertex_bytes.resize(50, std::byte{7});
    PageLevels levels;
    levels.levels[0] = std::make_shared<const std::vector<std::byte>>(to_payload(frame));
    store.put_page(key, version, Time{5}, levels);
  }

  LiveStore store;
  std::string hello_text = R"({"protocol":1})";
  std::vector<ReplayRequest> replays;
  std::function<void(const ReplayRequest&)> replay = [this](const ReplayRequest& request) {
    replays.push_back(request);
  };
  Duration now;
  LiveSession session{{store, hello_text, replay}, now};
};

TEST_F(LiveSessionTest, NothingButHelloComesBeforeTheViewersHello) {
  put_page({1, 2, 3}, 4);
  EXPECT_EQ(next()->kind, LiveKind::kHello);
  EXPECT_FALSE(next());
  EXPECT_THAT(say(R"({"type":"ack","sequence":1})")->reason, HasSubstr("first message has to be hello"));
  EXPECT_FALSE(say(R"({"type":"hello","protocol":1})"));
  EXPECT_EQ(next()->kind, LiveKind::kMeshPage);
  EXPECT_FALSE(say(R"({"type":"ack","sequence":2})"));
  EXPECT_THAT(say(R"({"type":"hello","protocol":1})")->reason, HasSubstr("before"));
}

TEST_F(LiveSessionTest, AViewerWithoutHelloIsEnded) {
  next();
  now = {9'999'000'000};
  EXPECT_TRUE(std::holds_alternative<std::monostate>(session.next(now)));
  now = {10'000'000'000};
  const WebOutput output = session.next(now);
  EXPECT_EQ(std::get<WebClose>(output).code, WebClose::kPolicy);
}

TEST_F(LiveSessionTest, TheAgeOfAPageIsThatOfItsSending) {
  put_page({1, 2, 3}, 4);
  next();
  say(R"({"type":"hello","protocol":1})");
  const auto page = std::get<MeshPageFrame>(next()->frame);
  EXPECT_GE(page.age_s, 100);
  EXPECT_LT(page.age_s, 160);
  EXPECT_EQ(page.version, 4u);
  EXPECT_EQ(page.vertex_bytes, std::vector<std::byte>(50, std::byte{7}));
}

TEST_F(LiveSessionTest, PagesOfTheSameSessionAreNotSentAgain) {
  for (int x = 0; x < 4; ++x) put_page({x, 0, -1}, 7);
  next();
  const std::string session_name = store.session();
  EXPECT_FALSE(say(R"({"type":"hello","protocol":1,"session":")" + session_name +
                   R"(","pages":[0,0,-1,7,0],"more":true})"));
  EXPECT_FALSE(next());
  EXPECT_FALSE(say(R"({"type":"hello","protocol":1,"session":")" + session_name +
                   R"(","pages":[1,0,-1,7,0, 2,0,-1,6,0],"more":false})"));
  EXPECT_EQ(std::get<MeshPageFrame>(next()->frame).key, (PageKey{2, 0, -1}));
  EXPECT_EQ(std::get<MeshPageFrame>(next()->frame).key, (PageKey{3, 0, -1}));
  EXPECT_FALSE(next());
}

TEST_F(LiveSessionTest, PagesOfAnotherSessionCountForNothing) {
  put_page({0, 0, 0}, 7);
  next();
  EXPECT_FALSE(say(R"({"type":"hello","protocol":1,"session":"other","pages":[0,0,0,7,0]})"));
  EXPECT_EQ(next()->kind, LiveKind::kMeshPage);
}

TEST_F(LiveSessionTest, AllLevelsAreSentToThoseWhoAskForThem) {
  PageLevels levels;
  for (const auto level : {std::uint8_t{0}, std::uint8_t{1}}) {
    MeshPageFrame frame;
    frame.level = level;
    levels.levels[level] = std::make_shared<const std::vector<std::byte>>(to_payload(frame));
  }
  store.put_page({0, 0, 0}, 1, {}, levels);
  next();
  EXPECT_FALSE(say(R"({"type":"hello","protocol":1,"all_levels":true})"));
  EXPECT_EQ(std::get<MeshPageFrame>(next()->frame).level, 0);
  EXPECT_EQ(std::get<MeshPageFrame>(next()->frame).level, 1);
  EXPECT_FALSE(next());
}

TEST_F(LiveSessionTest, ReplayIsSteered) {
  say(R"({"type":"hello","protocol":1})");
  EXPECT_FALSE(say(R"({"type":"replay","paused":true,"speed":2})"));
  EXPECT_FALSE(say(R"({"type":"replay","seek_s":12.5})"));
  ASSERT_EQ(replays.size(), 2u);
  EXPECT_EQ(replays[0].paused, true);
  EXPECT_EQ(replays[0].speed, 2);
  EXPECT_FALSE(replays[0].seek_s);
  EXPECT_EQ(replays[1].seek_s, 12.5);
  EXPECT_TRUE(say(R"({"type":"replay","speed":0})"));
  EXPECT_TRUE(say(R"({"type":"replay","seek_s":"x"})"));
  EXPECT_TRUE(say(R"({"type":"replay","paused":1})"));
  replay = nullptr;
  EXPECT_THAT(say(R"({"type":"replay","paused":true})")->reason, HasSubstr("no replay"));
}

TEST_F(LiveSessionTest, WhatBreaksTheRulesEndsWithAReason) {
  EXPECT_EQ(say("binary", false)->code, WebClose::kData);
  EXPECT_THAT(say(R"({"type":"hello","protocol":2})")->reason, HasSubstr("protocol 1"));
  EXPECT_THAT(say(R"({"type":"hello"})")->reason, HasSubstr("protocol 1"));
  EXPECT_THAT(say(R"({"type":"hello","protocol":1,"all_levels":1})")->reason, HasSubstr("all_levels"));
  ASSERT_FALSE(say(R"({"type":"hello","protocol":1})"));
  EXPECT_THAT(say(R"({"type":"command","kind":"take_off"})")->reason, HasSubstr("'command' is not known"));
  for (const char* text :
       {"", "[]", "{}", "null", R"({"type":3})", R"({"type":"view","position":[1,2,3]})",
        R"({"type":"view","position":[1,2],"direction":[1,0,0]})",
        R"({"type":"view","position":[1,2,3],"direction":[0,0,0]})",
        R"({"type":"view","position":[1,2,1e999],"direction":[1,0,0]})", R"({"type":"ack"})",
        R"({"type":"ack","sequence":-1})", R"({"type":"ack","sequence":0})",
        R"({"type":"ack","sequence":4294967296})", R"({"type":"ack","sequence":9})"})
    EXPECT_EQ(say(text)->code, WebClose::kProtocol) << text;
}

TEST_F(LiveSessionTest, AnAckOfWhatIsAcknowledgedIsTakenOneBeforeItEnds) {
  put_page({0, 0, 0}, 1);
  next();
  say(R"({"type":"hello","protocol":1})");
  ASSERT_TRUE(next());
  EXPECT_FALSE(say(R"({"type":"ack","sequence":2})"));
  EXPECT_FALSE(say(R"({"type":"ack","sequence":2})"));
  const auto end = say(R"({"type":"ack","sequence":1})");
  ASSERT_TRUE(end);
  EXPECT_EQ(end->code, WebClose::kProtocol);
  EXPECT_EQ(end->reason, "ack of a frame before one that was acknowledged");
}

TEST_F(LiveSessionTest, KnownPagesAreCheckedAndLimited) {
  const std::string start =
      R"({"type":"hello","protocol":1,"more":true,"session":")" + store.session() + R"(","pages":)";
  for (const char* pages :
       {"1", "[1]", "[1,2,3,4]", "[1,2,3,4,3]", "[1,2,3,-4,0]", "[1,2,3000000000,4,0]", R"([1,2,3,"4",0])"})
    EXPECT_TRUE(say(start + pages + "}")) << pages;
  std::string pages = "[";
  for (int i = 0; i < 5000; ++i) pages += std::to_string(i) + ",0,0,1,0,";
  pages.back() = ']';
  int accepted = 0;
  while (accepted < 100 && !say(start + pages + "}")) ++accepted;
  EXPECT_EQ(accepted, 39);  // 200,000 pages, less those of the messages before
}

TEST_F(LiveSessionTest, EveryPrefixAndRandomDamageIsTakenOrRefused) {
  put_page({0, 0, 0}, 7);
  next();
  const std::string hello = R"({"type":"hello","protocol":1,"session":")" + store.session() +
                            R"(","pages":[1,0,-1,7,0],"more":true})";
  const std::string view = R"({"type":"view","position":[1,2,3],"direction":[1,0,0]})";
  for (const auto& whole : {hello, view}) {
    for (std::size_t size = 0; size < whole.size(); ++size) EXPECT_TRUE(say(whole.substr(0, size))) << size;
    Rng rng(9);
    for (int round = 0; round < 10'000; ++round) {
      std::string text = whole;
      for (int k = 0; k < 3; ++k)
        text[rng.below(static_cast<std::uint32_t>(text.size()))] = static_cast<char>(rng.below(256));
      say(text);
    }
    say(R"({"type":"hello","protocol":1})");
  }
  EXPECT_TRUE(next());
}

}  // namespace
}  // namespace hm
