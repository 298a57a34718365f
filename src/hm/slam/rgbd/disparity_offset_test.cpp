#include "hm/slam/rgbd/disparity_offset.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stop_token>
#include <utility>
#include <vector>

#include "hm/slam/rgbd/testing/depth_walk.hpp"

namespace hm {
namespace {

using test::DepthView;
using test::DepthWalk;
using test::kHalfRoom_m;
using test::kOffMotion;

TEST(DisparityOffset, JacobianAgainstDifferences) {
  const DepthWalk walk(kHalfRoom_m, {1, 0.01});
  EXPECT_GT(test::expect_derivatives(walk.pairs(kOffMotion)[3], {0.0, 0.03}, offset_residual), 2000U);
}

TEST(DisparityOffset, RecoversKnownOffsets) {
  for (const double truth : {-0.02, 0.0, 0.01, 0.02}) {
    const DepthWalk walk(kHalfRoom_m, {1, truth});
    const DisparityOffset found = estimate_disparity_offset(walk.pairs(kOffMotion), {});
    EXPECT_TRUE(found.is_observed);
    EXPECT_GE(found.pairs, 8U);
    EXPECT_NEAR(found.offset_1_m, truth, 0.003);
    EXPECT_LT(std::abs(found.offset_1_m - truth), 3 * found.sigma_1_m);
    EXPECT_EQ(found.is_worth_a_calibration(), std::abs(truth) > 0.015);
  }
}

/// A camera whose depths are all too small: the scale of the room, which nothing contradicts.
TEST(DisparityOffset, IsNotMisledByTheScaleOfDepth) {
  const DisparityOffset found = estimate_disparity_offset(DepthWalk(kHalfRoom_m, {0.96, 0}).pairs(), {});
  EXPECT_TRUE(found.is_observed);
  EXPECT_NEAR(found.offset_1_m, 0, 0.005);
  EXPECT_FALSE(found.is_worth_a_calibration());
}

/// Readings that are larger than they ought to be by their own noise must not make all depths shrink.
TEST(DisparityOffset, NoiseDoesNotPullIt) {
  double sum = 0;
  for (const std::uint64_t seed : {2, 3, 4})
    sum += estimate_disparity_offset(DepthWalk(2 * kHalfRoom_m, {}, seed).pairs(), {}).offset_1_m;
  EXPECT_NEAR(sum / 3, 0, 0.003);
}

/// A frontal wall at always the same distance: any offset explains it.
TEST(DisparityOffset, ReturnsToItsPriorWhereNothingTells) {
  Rng rng(1);
  const SE3 T_world_depth(Mat3::Identity(), Vec3(0, 0, 0.9));
  const DepthView one(Vec3(9, 9, 2.5), T_world_depth, rng, {1, 0.02}),
      other(Vec3(9, 9, 2.5), T_world_depth, rng, {1, 0.02});
  const std::vector<SurfacePair> pairs{{one.elements, other.grid, {}, 0}, {other.elements, one.grid, {}, 1}};
  for (const auto& seen : {std::span<const SurfacePair>(), std::span<const SurfacePair>(pairs)}) {
    const DisparityOffset found = estimate_disparity_offset(seen, {});
    EXPECT_FALSE(found.is_observed);
    EXPECT_EQ(found.offset_1_m, 0);
    EXPECT_EQ(found.sigma_1_m, DisparityOffset::kPriorSigma_1_m);
  }
}

TEST(DisparityOffset, ReportsProgressAndStopsWithoutAnEstimate) {
  const DepthWalk walk(kHalfRoom_m, {1, 0.02});
  const std::vector<SurfacePair> pairs = walk.pairs(kOffMotion);
  std::vector<Progress> progress;
  RunContext run;
  run.progress = [&](const Progress& now) { progress.push_back(now); };
  EXPECT_TRUE(estimate_disparity_offset(pairs, {}, run).is_observed);
  ASSERT_GT(progress.size(), pairs.size());
  for (std::size_t i = 0; i < progress.size(); ++i) EXPECT_EQ(progress[i].done, i);
  EXPECT_EQ(progress.back().stage, "offset of disparity");
  EXPECT_EQ(progress.back().total, 5 * pairs.size());
  progress.clear();
  std::stop_source stop;
  run.stop = stop.get_token();
  run.progress = [&](const Progress& now) {
    progress.push_back(now);
    if (now.done == pairs.size() + 3) stop.request_stop();  // in the second iteration
  };
  const DisparityOffset stopped = estimate_disparity_offset(pairs, {}, run);
  EXPECT_TRUE(stopped.interrupted);
  EXPECT_FALSE(stopped.is_observed);
  EXPECT_EQ(stopped.offset_1_m, 0);
  EXPECT_EQ(stopped.sigma_1_m, DisparityOffset::kPriorSigma_1_m);
  EXPECT_EQ(progress.size(), pairs.size() + 4);
}

TEST(DisparityOffset, GivesTheSameBitsAgain) {
  const DepthWalk walk(kHalfRoom_m, {1, 0.01});
  const DisparityOffset found = estimate_disparity_offset(walk.pairs(kOffMotion), {}),
                        again = estimate_disparity_offset(walk.pairs(kOffMotion), {});
  EXPECT_EQ(found.offset_1_m, again.offset_1_m);
  EXPECT_EQ(found.sigma_1_m, again.sigma_1_m);
}

}  // namespace
}  // namespace hm
