#include "hm/station/pilot_desk.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Optional;

struct RecordedFlight : PilotHandler {
  void take(const PilotOrder& order) override { orders.push_back(order); }
  void hold(const std::string& reason) override { holds.push_back(reason); }
  std::vector<PilotOrder> orders;
  std::vector<std::string> holds;
};

constexpr Duration ms(std::int64_t milliseconds) { return {milliseconds * 1'000'000}; }

/// A desk with pilots that answer every ping at once, unless they are cut off.
class PilotDeskTest : public testing::Test {
 protected:
  PilotId open() {
    const PilotId id = desk.open(now);
    answers[id] = true;
    said(id);
    return id;
  }
  /// What the desk has said to a pilot since the last call, without pings, which are answered.
  std::vector<std::string> said(PilotId id) {
    std::vector<std::string> result;
    while (const auto text = desk.next(id, now)) {
      if (text->find("\"ping\"") == std::string::npos) {
        result.push_back(*text);
      } else if (answers[id]) {
        const auto digits = text->find("sequence\":") + 10;
        EXPECT_FALSE(
            send(id, fmt::format(R"({{"type":"pong","sequence":{}}})", std::stoll(text->substr(digits)))));
      }
    }
    return result;
  }
  std::optional<std::string> send(PilotId id, const std::string& text) { return desk.receive(id, text, now); }
  void take(PilotId id, bool force = false) {
    EXPECT_FALSE(send(id, fmt::format(R"({{"type":"take","force":{}}})", force)));
  }
  /// Answer to a command, which is recorded as accepted when it comes through.
  std::string command(PilotId id, const std::string& kind, std::int64_t sequence, int age_ms = 0,
                      int expires_ms = 1000, const std::string& more = "") {
    said(id);
    const std::size_t before = flight.orders.size();
    EXPECT_FALSE(send(
        id, fmt::format(R"({{"type":"command","sequence":{},"kind":"{}","age_ms":{},"expires_ms":{}{}}})",
                        sequence, kind, age_ms, expires_ms, more)));
    if (flight.orders.size() > before) return "";
    const auto texts = said(id);
    return texts.empty() ? "no answer" : texts.back();
  }
  std::string velocity(PilotId id, std::int64_t sequence, int age_ms = 0, int expires_ms = 300) {
    return command(id, "velocity", sequence, age_ms, expires_ms,
                   R"(,"velocity_m_s":[1,2,-0.5],"yaw_rad_s":0.25)");
  }
  /// Time goes on in steps of 10 ms.
  void wait(std::int64_t milliseconds) {
    for (std::int64_t passed = 0; passed < milliseconds; passed += 10) {
      now.ns += ms(10).ns;
      desk.tick(now);
      for (const auto& [id, connected] : answers)
        if (connected) kept[id].clear(), kept[id] = said(id);
    }
  }

  RecordedFlight flight;
  PilotDesk desk{flight};
  Duration now = ms(5000);
  std::map<PilotId, bool> answers;
  std::map<PilotId, std::vector<std::string>> kept;
};

constexpr const char* kYou = R"({"type":"lease","holder":"you"})";
constexpr const char* kOther = R"({"type":"lease","holder":"other"})";
constexpr const char* kNone = R"({"type":"lease","holder":"none"})";

TEST_F(PilotDeskTest, OnlyTheHolderOfTheLeaseFlies) {
  const PilotId first = open(), second = open();
  EXPECT_THAT(command(first, "take_off", 1), HasSubstr("take the lease first"));
  take(first);
  EXPECT_THAT(said(first), ElementsAre(kYou));
  EXPECT_THAT(said(second), ElementsAre(kOther));
  EXPECT_EQ(command(first, "take_off", 2), "");
  EXPECT_THAT(command(second, "land", 1), HasSubstr("another pilot has the lease"));
  take(second);
  EXPECT_THAT(said(second), ElementsAre(kOther));
  EXPECT_THAT(command(second, "land", 2), HasSubstr("another pilot has the lease"));
  ASSERT_EQ(flight.orders.size(), 1u);
  EXPECT_EQ(flight.orders[0].kind, "take_off");
}

TEST_F(PilotDeskTest, TakeOverNeedsForceAndStopsWhatTheOtherSteered) {
  const PilotId first = open(), second = open();
  take(first);
  EXPECT_EQ(velocity(first, 1), "");
  said(second);
  take(second, true);
  EXPECT_THAT(said(first), ElementsAre(kOther));
  EXPECT_THAT(said(second), ElementsAre(kYou));
  EXPECT_THAT(flight.holds, ElementsAre("another pilot took over"));
  EXPECT_THAT(velocity(first, 2), HasSubstr("another pilot has the lease"));
}

TEST_F(PilotDeskTest, ReleaseAndLossOfTheConnectionFreeTheLease) {
  const PilotId first = open(), second = open();
  take(first);
  EXPECT_FALSE(send(first, R"({"type":"release"})"));
  EXPECT_THAT(flight.holds, IsEmpty());
  said(second);
  take(second);
  EXPECT_EQ(velocity(second, 1), "");
  said(first);
  desk.close(second);
  answers.erase(second);
  EXPECT_THAT(flight.holds, ElementsAre("the pilot's connection ended"));
  EXPECT_THAT(said(first), ElementsAre(kNone));
  wait(1000);
  EXPECT_EQ(flight.holds.size(), 1u);
}

TEST_F(PilotDeskTest, ALandingGoesOnWithoutThePilotAFlightToAPointDoesNot) {
  const PilotId first = open();
  take(first);
  EXPECT_EQ(command(first, "land", 1), "");
  desk.close(first);
  answers.clear();
  EXPECT_THAT(flight.holds, IsEmpty());
  const PilotId second = open();
  take(second);
  EXPECT_EQ(command(second, "go_to", 1, 0, 1000, R"(,"position_m":[1,2,3],"yaw_rad":0.5)"), "");
  EXPECT_EQ(flight.orders.back().vector, (std::array{1.0, 2.0, 3.0}));
  EXPECT_EQ(flight.orders.back().yaw, 0.5);
  desk.close(second);
  EXPECT_EQ(flight.holds.size(), 1u);
}

TEST_F(PilotDeskTest, TheVehicleHolds300MillisecondsAfterTheLastInput) {
  const PilotId pilot = open();
  take(pilot);
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(velocity(pilot, i + 1), "");
    wait(50);
  }
  EXPECT_THAT(flight.holds, IsEmpty());  // 50 ms after the last one
  wait(240);
  EXPECT_THAT(flight.holds, IsEmpty());
  wait(10);
  EXPECT_EQ(flight.holds.size(), 1u);
  wait(2000);
  EXPECT_EQ(flight.holds.size(), 1u);
  EXPECT_EQ(velocity(pilot, 50), "");  // and flies on with new input
}

TEST_F(PilotDeskTest, AFrozenPageDoesNotFly) {
  const PilotId pilot = open();
  take(pilot);
  EXPECT_EQ(velocity(pilot, 1), "");
  // Its worker goes on sending, with the rising age of the last input.
  int refused = 0;
  for (int age_ms = 30; age_ms < 600; age_ms += 30) {
    wait(30);
    if (!velocity(pilot, age_ms, age_ms).empty()) ++refused;
    EXPECT_EQ(flight.holds.size(), age_ms >= 300 ? 1u : 0u) << age_ms;
  }
  EXPECT_GT(refused, 5);
}

TEST_F(PilotDeskTest, AHeldButtonOfAnotherKindEndsTheDeadMansRule) {
  const PilotId pilot = open();
  take(pilot);
  EXPECT_EQ(velocity(pilot, 1), "");
  EXPECT_EQ(command(pilot, "hold", 2), "");
  wait(1000);
  EXPECT_THAT(flight.holds, IsEmpty());
  EXPECT_EQ(velocity(pilot, 3), "");
  EXPECT_EQ(command(pilot, "preview", 4, 0, 1000, R"(,"position_m":[1,2,3],"yaw_rad":0)"), "");
  wait(1000);
  EXPECT_EQ(flight.holds.size(), 1u);
}

TEST_F(PilotDeskTest, OldAndRepeatedCommandsAreRefused) {
  const PilotId pilot = open();
  take(pilot);
  EXPECT_EQ(command(pilot, "land", 5), "");
  EXPECT_THAT(command(pilot, "land", 5), HasSubstr("sequence 5 is not above 5"));
  EXPECT_THAT(command(pilot, "land", 4), HasSubstr("not above"));
  EXPECT_EQ(command(pilot, "land", 6, 990), "");
  EXPECT_THAT(command(pilot, "land", 7, 200, 100), HasSubstr("too old"));
  EXPECT_THAT(command(pilot, "land", 8, 1200, 5000), HasSubstr("allowed are 1000 ms"));
  EXPECT_THAT(velocity(pilot, 9, 400, 1000), HasSubstr("allowed are 300 ms"));
  EXPECT_THAT(command(pilot, "land", 10, -1), HasSubstr("age_ms"));
  EXPECT_THAT(command(pilot, "fly", 11), HasSubstr("'fly' is not known"));
  EXPECT_THAT(command(pilot, "velocity", 12), HasSubstr("three numbers"));
  EXPECT_THAT(command(pilot, "go_to", 13, 0, 1000, R"(,"position_m":[1,null,3],"yaw_rad":0)"),
              HasSubstr("three numbers"));
  EXPECT_EQ(flight.orders.size(), 2u);
}

TEST_F(PilotDeskTest, ALineThatStalledDeliversNoOldCommands) {
  const PilotId pilot = open();
  take(pilot);
  wait(100);
  EXPECT_EQ(velocity(pilot, 1), "");
  answers[pilot] =
      false;  // two seconds of nothing, then everything that the page said meanwhile, with an age of 0
  wait(2000);
  EXPECT_EQ(flight.holds.size(), 1u);
  const std::size_t before = flight.orders.size();
  for (int i = 2; i < 40; ++i)
    send(pilot,
         fmt::format(R"({{"type":"command","sequence":{},"kind":"velocity","age_ms":0,"expires_ms":300,)"
                     R"("velocity_m_s":[1,0,0],"yaw_rad_s":0}})",
                     i));
  send(pilot, R"({"type":"command","sequence":40,"kind":"take_off","age_ms":0,"expires_ms":1000})");
  EXPECT_EQ(flight.orders.size(), before);
  answers[pilot] = true;
  wait(60);
  EXPECT_EQ(velocity(pilot, 41), "");
}

TEST_F(PilotDeskTest, EmergencyStopNeedsNothing) {
  const PilotId first = open(), second = open();
  take(first);
  EXPECT_EQ(velocity(first, 1), "");
  answers[second] = false;
  wait(200);
  EXPECT_EQ(velocity(first, 2), "");
  EXPECT_EQ(command(second, "e_stop", 1, 99'999, 1), "");
  EXPECT_EQ(command(second, "e_stop", 1), "");
  EXPECT_FALSE(send(second, R"({"type":"command","sequence":0,"kind":"e_stop"})"));
  EXPECT_EQ(flight.orders.size(), 5u);
  EXPECT_EQ(flight.orders.back().kind, "e_stop");
}

TEST_F(PilotDeskTest, AnswersGoToWhoAskedWithTheirOwnSequence) {
  const PilotId first = open(), second = open();
  take(first);
  EXPECT_EQ(command(first, "take_off", 700), "");
  EXPECT_EQ(command(second, "e_stop", 700), "");
  said(first), said(second);
  desk.answer(flight.orders[0].sequence, false, "battery");
  EXPECT_THAT(said(first),
              ElementsAre(R"({"type":"answer","sequence":700,"accepted":false,"reason":"battery"})"));
  EXPECT_THAT(said(second), IsEmpty());
  desk.answer(flight.orders[1].sequence, true, "");
  EXPECT_THAT(said(second), ElementsAre(R"({"type":"answer","sequence":700,"accepted":true,"reason":""})"));
  desk.answer(flight.orders[1].sequence, true, "");
  desk.answer(12345, true, "");
  EXPECT_THAT(said(second), IsEmpty());
}

TEST_F(PilotDeskTest, PingsTellTheRoundTripAndWhoIsGone) {
  const PilotId pilot = desk.open(now);
  desk.next(pilot, now);
  now.ns += ms(40).ns;
  EXPECT_FALSE(send(pilot, R"({"type":"pong","sequence":1})"));
  now.ns += ms(20).ns;
  desk.tick(now);
  EXPECT_THAT(desk.next(pilot, now),
              Optional(std::string(R"({"type":"ping","sequence":2,"round_trip_ms":40.0})")));
  EXPECT_THAT(send(pilot, R"({"type":"pong","sequence":3})"), Optional(HasSubstr("was not sent")));
  EXPECT_FALSE(desk.reason_to_end(pilot, now));
  now.ns += ms(3001).ns;
  EXPECT_THAT(desk.reason_to_end(pilot, now), Optional(HasSubstr("no answer to pings")));
}

TEST_F(PilotDeskTest, APilotThatReadsNothingIsEnded) {
  const PilotId pilot = open();
  for (int i = 0; i <= static_cast<int>(PilotDesk::kMaxWaiting); ++i) take(pilot);
  EXPECT_THAT(desk.reason_to_end(pilot, now), Optional(HasSubstr("not read")));
}

TEST_F(PilotDeskTest, DamagedMessagesEndTheConnectionAndMoveNothing) {
  const PilotId pilot = open();
  take(pilot);
  const std::string whole = R"({"type":"command","sequence":1,"kind":"velocity","age_ms":0,"expires_ms":300,)"
                            R"("velocity_m_s":[1,2,3],"yaw_rad_s":0.5})";
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_TRUE(send(pilot, whole.substr(0, size))) << size;
  for (const char* text :
       {"[]", "1", "{}", R"({"type":1})", R"({"type":"comand"})", R"({"type":"command"})",
        R"({"type":"command","sequence":-1,"kind":"land"})",
        R"({"type":"command","sequence":1.5,"kind":"land"})", R"({"type":"pong"})", "\xff\xfe"})
    EXPECT_TRUE(send(pilot, text)) << text;
  EXPECT_THAT(flight.orders, IsEmpty());
  Rng rng(3);
  for (int round = 0; round < 20'000; ++round) {
    std::string text = whole;
    for (int k = 0; k < 3; ++k)
      text[rng.below(static_cast<std::uint32_t>(text.size()))] = static_cast<char>(rng.below(256));
    send(pilot, text);
    while (desk.next(pilot, now)) {
    }
  }
  for (const auto& order : flight.orders)
    for (const double value : order.vector) EXPECT_TRUE(std::isfinite(value));
}

}  // namespace
}  // namespace hm
