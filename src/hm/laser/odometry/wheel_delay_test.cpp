#include "hm/laser/odometry/wheel_delay.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

constexpr double kInterval_s = 0.1;
constexpr int kDelayedScans = 400;

/// A drive whose odometry is read at the stamps of the scans, and interpolated between them.
struct Drive {
  double late_s = 0;       ///< of the scans' stamps
  double swing_rad = 0.8;  ///< of the heading, to and fro
  double matched_noise_rad = 0.005, wheel_noise_rad = 0, rounded_to_rad = 0;
  int scans = kDelayedScans;

  [[nodiscard]] double heading_rad(double time_s) const {
    return swing_rad * (std::sin(1.1 * time_s) + 0.25 * std::sin(4.3 * time_s));
  }
  [[nodiscard]] double learn(std::uint64_t seed) const {
    Rng rng(seed);
    std::vector<double> readings;
    double error_rad = 0;
    for (int i = 0; i < scans; ++i) {
      const double reading = heading_rad(kInterval_s * i) + error_rad;
      readings.push_back(rounded_to_rad > 0 ? std::round(reading / rounded_to_rad) * rounded_to_rad
                                            : reading);
      error_rad += wheel_noise_rad * rng.normal();
    }
    const auto at = [&](Time time) -> std::optional<double> {
      const double place = time.seconds() / kInterval_s;
      const auto before = static_cast<std::ptrdiff_t>(std::floor(place + 1e-9));
      if (before < 0 || before + 1 >= static_cast<std::ptrdiff_t>(readings.size())) return std::nullopt;
      const auto i = static_cast<std::size_t>(before);
      return std::lerp(readings[i], readings[i + 1], place - static_cast<double>(before));
    };
    WheelDelay delay;
    for (int i = 0; i + 2 < scans; ++i) {
      const double from_s = kInterval_s * i, to_s = from_s + kInterval_s;
      delay.learn(
          Time::from_seconds(from_s), Time::from_seconds(to_s),
          heading_rad(to_s - late_s) - heading_rad(from_s - late_s) + matched_noise_rad * rng.normal(), at);
    }
    return delay.delay().seconds();
  }
};

TEST(WheelDelay, FindsHowLateScansAreStamped) {
  for (const double late_s : {0.12, 0.2, 0.3})
    for (const double wheel_noise_rad : {0.0, 0.005})
      for (const std::uint64_t seed : {1, 2, 3})
        EXPECT_NEAR((Drive{.late_s = late_s, .wheel_noise_rad = wheel_noise_rad}.learn(seed)), late_s, 0.041);
}

/// Interpolation smooths the noise of the wheels, which makes wrong delays look better.
TEST(WheelDelay, NoiseOfTheWheelsIsNoDelay) {
  constexpr double kDegree_rad = std::numbers::pi / 180;
  for (const std::uint64_t seed : {1, 2, 3, 4, 5})
    for (const double swing_rad : {0.0, 0.02, 0.3, 0.8})
      for (const Drive& drive : {Drive{.swing_rad = swing_rad, .wheel_noise_rad = 0.003},
                                 Drive{.swing_rad = swing_rad, .wheel_noise_rad = 0.01},
                                 Drive{.swing_rad = swing_rad, .rounded_to_rad = kDegree_rad}})
        EXPECT_LT(drive.learn(seed), 0.03) << swing_rad;
}

TEST(WheelDelay, IsZeroWhereNothingElseIsClearlyBetter) {
  // Too few scans, more noise than turns, a delay far beyond those that are tried.
  EXPECT_EQ((Drive{.late_s = 0.2, .scans = 30}.learn(1)), 0);
  EXPECT_EQ((Drive{.late_s = 0.2, .matched_noise_rad = 1}.learn(1)), 0);
  EXPECT_EQ((Drive{.late_s = 1.2}.learn(1)), 0);
  // The same turn all the time.
  WheelDelay delay;
  for (int i = 0; i < kDelayedScans; ++i)
    delay.learn(Time::from_seconds(0.1 * i), Time::from_seconds(0.1 * i + 0.1), 0.05,
                [](Time time) { return std::optional(0.5 * time.seconds()); });
  EXPECT_EQ(delay.delay(), Duration{});
}

}  // namespace
}  // namespace hm
