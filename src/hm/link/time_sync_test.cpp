#include "hm/link/time_sync.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hm/core/rng.hpp"
#include "hm/core/statistics.hpp"

namespace hm {
namespace {

/// A remote clock that is 1000 s ahead and gains 50 ppm; delays of 1 ms each way with exponential jitter of
/// 1 ms on average, of which each tenth waits up to 20 ms more.
struct ClockPair {
  double offset_s = 1000, drift = 50e-6;
  Rng rng{1};
  [[nodiscard]] Time remote(double local_s) const {
    return Time::from_seconds(local_s + offset_s + drift * local_s);
  }
  double delay() {
    const double jitter_s = -0.001 * std::log(1 - rng.uniform());
    return 0.001 + jitter_s + (rng.below(10) == 0 ? 0.02 * rng.uniform() : 0);
  }
  TimeSync::Update exchange(TimeSync& sync, double local_s) {
    const double there = delay(), back = delay();
    return sync.add(Time::from_seconds(local_s), remote(local_s + there),
                    Time::from_seconds(local_s + there + back));
  }
};

TEST(TimeSync, FollowsClocksThatDifferBy50PpmWithinHalfAMillisecond) {
  for (const double drift : {50e-6, -50e-6, 0.0}) {
    ClockPair clocks;
    clocks.drift = drift;
    TimeSync sync;
    EXPECT_FALSE(sync.offset_at(Time{}));
    double worst_s = 0;
    for (int second = 0; second < 600; ++second) {
      EXPECT_EQ(clocks.exchange(sync, second), TimeSync::Update::kUsed);
      if (second < 32) continue;
      for (const double later : {0.1, 0.9}) {
        const double t = second + later;
        const double error = (*sync.to_remote(Time::from_seconds(t)) - clocks.remote(t)).seconds();
        worst_s = std::max(worst_s, std::abs(error));
      }
    }
    EXPECT_LT(worst_s, 0.5e-3) << drift;
    EXPECT_NEAR(sync.drift(), drift, 20e-6);
  }
}

TEST(TimeSync, TenMinutesOfManySeedsStayWithinHalfAMillisecond) {
  constexpr int kSeeds = 20;
  std::vector<double> worst_s;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    ClockPair clocks;
    clocks.rng = Rng(seed);
    TimeSync sync;
    double worst = 0;
    for (int second = 0; second < 600; ++second) {
      clocks.exchange(sync, second);
      if (second < static_cast<int>(TimeSync::kWindow)) continue;
      const double t = second + 0.9;
      worst =
          std::max(worst, std::abs((*sync.to_remote(Time::from_seconds(t)) - clocks.remote(t)).seconds()));
    }
    worst_s.push_back(worst);
  }
  EXPECT_LT(quantile(worst_s, 0.95), 0.4e-3);
}

TEST(TimeSync, ADriftThatChangesAsQuartzWarmsIsFollowed) {
  ClockPair clocks;
  clocks.drift = 0;
  TimeSync sync;
  double gained_s = 0, worst_s = 0;
  for (int second = 0; second < 1200; ++second) {
    gained_s += 10e-6 * second / 1200;  // 10 ppm in twenty minutes
    clocks.offset_s = 1000 + gained_s;
    EXPECT_EQ(clocks.exchange(sync, second), TimeSync::Update::kUsed);
    if (second < 64) continue;
    const double t = second + 0.5;
    worst_s =
        std::max(worst_s, std::abs((*sync.to_remote(Time::from_seconds(t)) - clocks.remote(t)).seconds()));
  }
  EXPECT_LT(worst_s, 0.5e-3);
}

TEST(TimeSync, ConvertsThereAndBack) {
  ClockPair clocks;
  TimeSync sync;
  for (int second = 0; second < 100; ++second) clocks.exchange(sync, second);
  for (double t = 90; t < 110; t += 0.7) {
    const Time local = Time::from_seconds(t);
    EXPECT_NEAR((*sync.to_local(*sync.to_remote(local)) - local).seconds(), 0, 1e-8);
  }
}

TEST(TimeSync, AStepOfTheOtherClockIsFollowedAtOnce) {
  ClockPair clocks;
  TimeSync sync;
  for (int second = 0; second < 50; ++second) clocks.exchange(sync, second);
  clocks.offset_s -= 990;  // it started anew
  EXPECT_EQ(clocks.exchange(sync, 50), TimeSync::Update::kClockStep);
  EXPECT_EQ(sync.steps(), 1U);
  EXPECT_NEAR((*sync.to_remote(Time::from_seconds(50)) - clocks.remote(50)).seconds(), 0, 0.011);
  EXPECT_EQ(clocks.exchange(sync, 51), TimeSync::Update::kUsed);
}

TEST(TimeSync, RoundTripsThatCannotBeAreRejected) {
  TimeSync sync;
  EXPECT_EQ(sync.add(Time{1'000}, Time{5}, Time{0}), TimeSync::Update::kRejected);
  EXPECT_EQ(sync.add(Time{0}, Time{5}, Time{2'000'000'000}), TimeSync::Update::kRejected);
  EXPECT_FALSE(sync.offset_at(Time{}));
  EXPECT_EQ(sync.add(Time{10'000}, Time{5}, Time{20'000}), TimeSync::Update::kUsed);
  EXPECT_EQ(sync.add(Time{1'000}, Time{5}, Time{2'000}), TimeSync::Update::kRejected);  // our clock went back
  EXPECT_EQ(sync.uncertainty()->ns, 5'000);
}

}  // namespace
}  // namespace hm
