#include "hm/pipeline/serve/replay.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "hm/core/stopwatch.hpp"

namespace hm {
namespace {

/// Notes what it is asked to show: a moment every 20 ms.
class Noted : public ReplaySubject {
 public:
  [[nodiscard]] std::size_t count() const override { return 100; }
  [[nodiscard]] Time stamp(std::size_t moment) const override {
    return Time::from_seconds(1000 + 0.02 * static_cast<double>(moment));
  }
  void restart() override {
    ++restarts;
    shown.clear();
  }
  void show(std::size_t moment) override { shown.push_back(moment); }
  void settle() override { settled = shown.size(); }
  std::vector<std::size_t> shown;
  std::size_t settled = 0;
  int restarts = 0;
};

double number(const JsonValue& json, std::string_view key) { return json.find(key)->number_or(-1); }

void play_to_end(Replay& replay) {
  const Stopwatch watch;
  while (!replay.at_end() && watch.seconds() < 20) replay.step(0.05);
}

TEST(Replay, ShowsEveryMomentInOrderAtTheAskedSpeed) {
  Noted subject;
  Replay replay(subject);
  replay.request({{}, 10.0, {}});
  const Stopwatch watch;
  play_to_end(replay);
  ASSERT_EQ(subject.shown.size(), 100u);
  for (std::size_t i = 0; i < 100; ++i) EXPECT_EQ(subject.shown[i], i);
  EXPECT_GT(watch.seconds(), 0.17);  // 1.98 s of recording, ten times as fast
  EXPECT_NEAR(number(replay.state(), "time_s"), 1.98, 1e-9);
  EXPECT_NEAR(number(replay.state(), "end_s"), 1.98, 1e-9);
  EXPECT_FALSE(replay.step(0.001));
  EXPECT_EQ(subject.settled, 100u);
}

TEST(Replay, WaitsWhilePausedButGoesToAPlace) {
  Noted subject;
  Replay replay(subject);
  replay.request({true, {}, {}});
  EXPECT_FALSE(replay.step(0.01));
  EXPECT_TRUE(subject.shown.empty());
  replay.request({{}, {}, 1.0});
  for (int i = 0; i < 60; ++i) replay.step(0.001);
  EXPECT_EQ(subject.shown.size(), 50u);
  EXPECT_EQ(subject.settled, 50u);
  EXPECT_NEAR(number(replay.state(), "time_s"), 0.98, 1e-9);
}

TEST(Replay, GoesBackByBeginningAnew) {
  Noted subject;
  Replay replay(subject);
  replay.request({{}, 100.0, {}});
  play_to_end(replay);
  replay.request({true, {}, 0.4});
  for (int i = 0; i < 60; ++i) replay.step(0.001);
  EXPECT_EQ(subject.restarts, 1);
  EXPECT_EQ(subject.shown.size(), 20u);
}

TEST(Replay, IgnoresWhatIsNoNumberAndLimitsTheSpeed) {
  Noted subject;
  Replay replay(subject);
  replay.request({{}, std::nan(""), std::numeric_limits<double>::infinity()});
  replay.request({{}, 1e9, {}});
  replay.step(0.001);
  EXPECT_EQ(number(replay.state(), "speed"), Replay::kHighestSpeed);
  replay.request({{}, -3.0, {}});
  replay.step(0.001);
  EXPECT_EQ(number(replay.state(), "speed"), Replay::kLowestSpeed);
}

}  // namespace
}  // namespace hm
