#include "hm/odometry/tracker/frame_clock.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

constexpr double kPeriod_s = 1.0 / 30;

/// Root of the mean squared error of the intervals between successive frames, after the first second.
double interval_error_s(const std::function<double(int)>& exposed_s, double jitter_s) {
  FrameClock clock;
  Rng rng(3);
  double sum = 0;
  Time last;
  constexpr int kFrames = 200, kFirst = 30;
  for (int i = 0; i < kFrames; ++i) {
    const Time stamp = Time::from_seconds(5 + exposed_s(i) + rng.uniform(0, jitter_s));
    clock.add(stamp);
    if (i >= kFirst) {
      const double error_s = clock.interval_s(last, stamp) - (exposed_s(i) - exposed_s(i - 1));
      sum += error_s * error_s;
    }
    last = stamp;
  }
  return std::sqrt(sum / (kFrames - kFirst));
}

TEST(FrameClock, IntervalsOfACameraDoNotJitterWithItsStamps) {
  const auto steady = [](int i) { return i * kPeriod_s; };
  EXPECT_LT(interval_error_s(steady, 0), 1e-9);
  EXPECT_LT(interval_error_s(steady, 0.014), 0.0005);  // their own differences are off by 0.0057
}

TEST(FrameClock, MissingFramesAreCounted) {
  const auto every_seventh_missing = [](int i) { return (i + i / 6) * kPeriod_s; };
  EXPECT_LT(interval_error_s(every_seventh_missing, 0.014), 0.0015);
}

TEST(FrameClock, StampsWithoutAFixedRateAreUsedAsTheyAre) {
  const auto uneven = [](int i) { return i * kPeriod_s + 0.4 * kPeriod_s * std::sin(2.4 * i); };
  EXPECT_LT(interval_error_s(uneven, 0), 1e-9);
  FrameClock clock;
  for (const double t_s : {1.0, 1.04, 1.07}) clock.add(Time::from_seconds(t_s));
  EXPECT_NEAR(clock.interval_s(Time::from_seconds(1.04), Time::from_seconds(1.07)), 0.03, 1e-9);
}

TEST(FrameClock, FramesOfLongAgoAreJudgedByTheirStamps) {
  FrameClock clock;
  const Time first = Time::from_seconds(1.01);
  clock.add(first);
  for (int i = 1; i < 60; ++i) clock.add(Time::from_seconds(1 + i * kPeriod_s));
  EXPECT_NEAR(clock.interval_s(first, Time::from_seconds(1 + 59 * kPeriod_s)), 59 * kPeriod_s - 0.01, 1e-8);
}

}  // namespace
}  // namespace hm
