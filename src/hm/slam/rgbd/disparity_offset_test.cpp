#include "hm/slam/rgbd/disparity_offset.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stop_token>
#include <utility>
#include <vector>

#include "hm/slam/rgbd/testing/landmark_world.hpp"

namespace hm {
namespace {

struct View {
  DepthGrid grid;
  std::vector<SurfaceElement> elements;
};

View view_in(const Vec3& half_size_m, const SE3& T_world_depth, const test::ReadingError& error, Rng& rng) {
  View view;
  view.grid = make_depth_grid(test::depth_in_room(half_size_m, T_world_depth, rng, error),
                              test::landmark_camera(), {}, 5);
  view.elements = sample_surface(view.grid, {}, 4);
  return view;
}

/// A camera that walks through a room and looks into its corners, each time from elsewhere.
class Walk {
 public:
  Walk(const Vec3& half_size_m, const test::ReadingError& error, std::uint64_t seed = 1) {
    Rng rng(seed);
    for (int i = 0; i < 16; ++i) {
      const double angle = 0.4 * i;
      const Mat3 R = so3_exp(Vec3(0, angle, 0)) * so3_exp(Vec3(0.35 * std::sin(1.7 * i), 0, 0));
      poses_.emplace_back(R, Vec3(0.7 * std::sin(2.1 * i), 0.3 * std::sin(1.3 * i), 0.7 * std::cos(1.1 * i)));
      views_.push_back(view_in(half_size_m, poses_.back(), error, rng));
    }
  }
  /// Motions are `off` by some centimetres, as odometry's are with wrong depth.
  [[nodiscard]] std::vector<SurfacePair> pairs(const SE3& off = {}) const {
    std::vector<SurfacePair> pairs;
    for (std::uint32_t a = 0; a + 1 < views_.size(); ++a)
      pairs.push_back({views_[a].elements, views_[a + 1].grid, off * poses_[a + 1].inverse() * poses_[a], a});
    return pairs;
  }

 private:
  std::vector<SE3> poses_;
  std::vector<View> views_;
};

const Vec3 kHalfRoom_m(2.0, 1.3, 1.7);
const SE3 kOff = SE3::exp((Vec6() << 0.02, -0.01, 0.015, 0.005, 0.004, -0.004).finished());

TEST(DisparityOffset, JacobianAgainstDifferences) {
  const Walk walk(kHalfRoom_m, {1, 0.01});
  constexpr double kStep = 1e-6;
  std::size_t compared = 0;
  SurfacePair pair = walk.pairs(kOff)[3];
  const SE3 T = pair.T_grid_element;
  for (const SurfaceElement& element : pair.elements)
    for (const double offset_1_m : {0.0, 0.03}) {
      pair.T_grid_element = T;
      const auto seen = offset_residual(pair, element, offset_1_m, {});
      if (!seen) continue;
      for (int k = 0; k < 7; ++k) {
        const auto moved = [&](double step) {
          Vec6 move = Vec6::Zero();
          if (k < 6) move[k] = step;
          pair.T_grid_element = SE3::exp(move) * T;
          return offset_residual(pair, element, offset_1_m + (k == 6 ? step : 0), {});
        };
        const auto more = moved(kStep), less = moved(-kStep);
        ASSERT_TRUE(more && less);
        const double difference = (more->distance_m - less->distance_m) / (2 * kStep);
        // Where a step reaches the next pixel, the reading is another one.
        if (std::abs(more->distance_m - less->distance_m) > 1e-4) continue;
        EXPECT_NEAR(seen->jacobian[k], difference, 1e-4 * (1 + std::abs(difference))) << k;
        ++compared;
      }
    }
  EXPECT_GT(compared, 2000U);
}

TEST(DisparityOffset, RecoversKnownOffsets) {
  for (const double truth : {-0.02, 0.0, 0.01, 0.02}) {
    const Walk walk(kHalfRoom_m, {1, truth});
    const DisparityOffset found = estimate_disparity_offset(walk.pairs(kOff), {});
    EXPECT_TRUE(found.is_observed);
    EXPECT_GE(found.pairs, 8U);
    EXPECT_NEAR(found.offset_1_m, truth, 0.003);
    EXPECT_LT(std::abs(found.offset_1_m - truth), 3 * found.sigma_1_m);
    EXPECT_EQ(found.is_worth_a_calibration(), std::abs(truth) > 0.015);
  }
}

/// A camera whose depths are all too small: the scale of the room, which nothing contradicts.
TEST(DisparityOffset, IsNotMisledByTheScaleOfDepth) {
  const DisparityOffset found = estimate_disparity_offset(Walk(kHalfRoom_m, {0.96, 0}).pairs(), {});
  EXPECT_TRUE(found.is_observed);
  EXPECT_NEAR(found.offset_1_m, 0, 0.005);
  EXPECT_FALSE(found.is_worth_a_calibration());
}

/// Readings that are larger than they ought to be by their own noise must not make all depths shrink.
TEST(DisparityOffset, NoiseDoesNotPullIt) {
  double sum = 0;
  for (const std::uint64_t seed : {2, 3, 4})
    sum += estimate_disparity_offset(Walk(2 * kHalfRoom_m, {}, seed).pairs(), {}).offset_1_m;
  EXPECT_NEAR(sum / 3, 0, 0.003);
}

/// A frontal wall at always the same distance: any offset explains it.
TEST(DisparityOffset, ReturnsToItsPriorWhereNothingTells) {
  Rng rng(1);
  const SE3 T_world_depth(Mat3::Identity(), Vec3(0, 0, 0.9));
  const View one = view_in(Vec3(9, 9, 2.5), T_world_depth, {1, 0.02}, rng),
             other = view_in(Vec3(9, 9, 2.5), T_world_depth, {1, 0.02}, rng);
  const std::vector<SurfacePair> pairs{{one.elements, other.grid, {}, 0}, {other.elements, one.grid, {}, 1}};
  for (const auto& seen : {std::span<const SurfacePair>(), std::span<const SurfacePair>(pairs)}) {
    const DisparityOffset found = estimate_disparity_offset(seen, {});
    EXPECT_FALSE(found.is_observed);
    EXPECT_EQ(found.offset_1_m, 0);
    EXPECT_EQ(found.sigma_1_m, DisparityOffset::kPriorSigma_1_m);
  }
}

TEST(DisparityOffset, ReportsProgressAndStopsWithoutAnEstimate) {
  const Walk walk(kHalfRoom_m, {1, 0.02});
  const std::vector<SurfacePair> pairs = walk.pairs(kOff);
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
  const Walk walk(kHalfRoom_m, {1, 0.01});
  const DisparityOffset found = estimate_disparity_offset(walk.pairs(kOff), {}),
                        again = estimate_disparity_offset(walk.pairs(kOff), {});
  EXPECT_EQ(found.offset_1_m, again.offset_1_m);
  EXPECT_EQ(found.sigma_1_m, again.sigma_1_m);
}

}  // namespace
}  // namespace hm
