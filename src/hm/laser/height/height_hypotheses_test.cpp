#include "hm/laser/height/height_hypotheses.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

constexpr double kHeight_m = 1.5;

/// What a mirror sees of one surface at a moment, with noise.
MirrorDistances surface(double seconds, double distance_m, Rng& rng) {
  MirrorDistances scan;
  scan.stamp = Time::from_seconds(seconds);
  const double seen_m = distance_m + rng.normal(0, 0.002);
  for (int i = 0; i < 20; ++i) scan.distances_m.push_back(seen_m + 0.002 * (i % 3 - 1));
  return scan;
}

/// Hovers for 15 s, 40 scans a second; the accelerometer has noise and a bias. The error of the height at the
/// end, and the largest.
template <class LevelOf, class WrongOf>
std::pair<double, double> errors(std::uint64_t seed, const LevelOf& level_m_of,
                                 const WrongOf& wrong_m_s2_of) {
  HeightHypotheses height;
  Rng rng(seed);
  double largest_m = 0, now_m = 0;
  for (int i = 0; i < 600; ++i) {
    const double time = 0.025 * i;
    const auto scan = surface(time, kHeight_m - level_m_of(time), rng);
    now_m =
        std::abs(height.update(scan, 0.15 + rng.normal(0, 0.03) + wrong_m_s2_of(time)).height_m - kHeight_m);
    largest_m = std::max(largest_m, now_m);
  }
  return {now_m, largest_m};
}

double nothing(double) { return 0; }

/// Three ramps of 1.2 s that end in an edge.
TEST(HeightHypotheses, ARampLeavesNoError) {
  for (const double slope_m_s : {0.5, 0.8}) {
    const auto ramps = [&](double time) {
      const double on_ramp = std::fmod(time, 5) - 3;
      return on_ramp > 0 && on_ramp < 1.2 ? slope_m_s * on_ramp : 0;
    };
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      const auto [end_m, largest_m] = errors(seed, ramps, nothing);
      EXPECT_LT(end_m, 0.1) << slope_m_s << " m/s, seed " << seed;
      EXPECT_LT(largest_m, 1.1 * 1.2 * slope_m_s) << "never more than one of them";
    }
  }
}

/// A knock, and one that lasts: the accelerometer alone would fly away by metres.
TEST(HeightHypotheses, AnAccelerometerThatIsWrongForAMomentDoesNoHarm) {
  for (const double wrong_m_s2 : {1.0, 5.0, 30.0}) {
    const auto knock = [&](double time) { return time > 8 && time < 8.5 ? wrong_m_s2 : 0; };
    EXPECT_LT(errors(1, nothing, knock).second, 0.01) << wrong_m_s2;
  }
}

TEST(HeightHypotheses, BoxesAreFloors) {
  const auto box = [](double time) { return time > 5 && time < 8 ? 0.4 : 0; };
  EXPECT_LT(errors(2, box, nothing).second, 0.02);
}

TEST(HeightHypotheses, WithoutAnAccelerationItIsTheEstimator) {
  HeightHypotheses height;
  HeightEstimator estimator;
  Rng rng(3);
  for (int i = 0; i < 200; ++i) {
    const auto scan = surface(0.025 * i, kHeight_m - 0.002 * i, rng);
    ASSERT_EQ(height.update(scan, {}).height_m, estimator.update(scan).height_m);
  }
}

}  // namespace
}  // namespace hm
