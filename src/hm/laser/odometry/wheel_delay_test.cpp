#include "hm/laser/odometry/wheel_delay.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

constexpr double kInterval_s = 0.1;

/// A vehicle that turns to and fro; its wheels err a little.
double heading_rad(double time_s) { return 0.8 * std::sin(1.1 * time_s) + 0.2 * std::sin(4.3 * time_s); }

struct Drive {
  double delay_s = 0, noise_rad = 0, stops_s = 1e9;
  /// Learns from so many scans, whose stamps are late by `delay_s`.
  [[nodiscard]] WheelDelay learn(int scans) const {
    Rng rng(7);
    WheelDelay delay;
    for (int i = 0; i < scans; ++i) {
      const double from_s = kInterval_s * i, to_s = from_s + kInterval_s;
      const double turn_rad = heading_rad(to_s - delay_s) - heading_rad(from_s - delay_s);
      delay.learn(Time::from_seconds(from_s), Time::from_seconds(to_s), turn_rad + noise_rad * rng.normal(),
                  [this](Time time) -> std::optional<double> {
                    if (time.seconds() > stops_s) return std::nullopt;
                    return heading_rad(time.seconds());
                  });
    }
    return delay;
  }
};

TEST(WheelDelay, FindsHowLateScansAreStamped) {
  for (const double delay_s : {-0.1, 0.06, 0.18, 0.3})
    for (const double noise_rad : {0.0, 0.01})
      EXPECT_NEAR((Drive{delay_s, noise_rad}.learn(200).delay().seconds()), delay_s, 0.021) << noise_rad;
}

TEST(WheelDelay, IsZeroWhereNothingElseIsClearlyBetter) {
  EXPECT_EQ((Drive{0, 0.01}.learn(400).delay()), Duration{});
  // Too few scans, more noise than turns, a delay beyond those that are tried, odometry that ends.
  EXPECT_EQ((Drive{0.18, 0}.learn(20).delay()), Duration{});
  EXPECT_EQ((Drive{0.18, 1}.learn(400).delay()), Duration{});
  EXPECT_EQ((Drive{1.2, 0}.learn(400).delay()), Duration{});
  EXPECT_EQ((Drive{0.18, 0, 2}.learn(400).delay()), Duration{});
}

TEST(WheelDelay, ConstantTurnsTellNothing) {
  WheelDelay delay;
  for (int i = 0; i < 300; ++i)
    delay.learn(Time::from_seconds(0.1 * i), Time::from_seconds(0.1 * i + 0.1), 0.05,
                [](Time time) { return std::optional(0.5 * time.seconds()); });
  EXPECT_EQ(delay.delay(), Duration{});
}

}  // namespace
}  // namespace hm
