#include "hm/slam/rgbd/focal_length_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stop_token>
#include <vector>

#include "hm/slam/rgbd/testing/depth_walk.hpp"

namespace hm {
namespace {

using test::DepthWalk;
using test::kHalfRoom_m;
using test::kOffMotion;

/// The camera that took the images, whose focal length would be `ratio` times the one that it is taken for.
PinholeCamera taken_for(double ratio) {
  PinholeCamera camera = test::landmark_camera();
  camera.fx /= ratio;
  camera.fy /= ratio;
  return camera;
}

TEST(FocalLengthCheck, JacobianAgainstDifferences) {
  const DepthWalk walk(kHalfRoom_m, {}, 1, taken_for(1.1));
  EXPECT_GT(test::expect_derivatives(walk.pairs(kOffMotion)[3], {0.0, 0.1}, focal_length_residual), 2000U);
}

TEST(FocalLengthCheck, FindsWrongFocalLengths) {
  for (const double truth : {0.87, 0.96, 1.0, 1.04, 1.15}) {
    const DepthWalk walk(kHalfRoom_m, {}, 1, taken_for(truth));
    const FocalLengthCheck found = check_focal_length(walk.pairs(kOffMotion), {});
    EXPECT_TRUE(found.is_observed) << truth;
    EXPECT_NEAR(found.ratio, truth, 0.03);
    EXPECT_EQ(found.seems_wrong(), std::abs(truth - 1) > 0.1) << truth << ", cost " << found.cost_ratio;
  }
}

/// All depths too small: the scale of the room, which is no stretch.
TEST(FocalLengthCheck, IsNotMisledByTheScaleOfDepth) {
  const FocalLengthCheck found = check_focal_length(DepthWalk(kHalfRoom_m, {0.94, 0}).pairs(), {});
  EXPECT_NEAR(found.ratio, 1, 0.02);
  EXPECT_FALSE(found.seems_wrong());
}

/// Without turns, nothing contradicts a stretched room: the way is stretched with it.
TEST(FocalLengthCheck, NeedsTurns) {
  constexpr double kRatio = 1.15;
  const DepthWalk walk(kHalfRoom_m, {}, 1, taken_for(kRatio), false);
  std::vector<SurfacePair> pairs;
  for (const SurfacePair& pair : walk.pairs()) {
    const Vec3 move = pair.T_grid_element.translation().cwiseProduct(Vec3(kRatio, kRatio, 1));
    pairs.push_back({pair.elements, pair.grid, SE3(Mat3::Identity(), move), pair.group});
  }
  EXPECT_FALSE(check_focal_length(pairs, {}).seems_wrong());
  EXPECT_FALSE(check_focal_length({}, {}).is_observed);
}

TEST(FocalLengthCheck, IsStoppedWithoutAnEstimate) {
  const DepthWalk walk(kHalfRoom_m, {}, 1, taken_for(1.15));
  std::stop_source stop;
  stop.request_stop();
  RunContext run;
  run.stop = stop.get_token();
  const FocalLengthCheck stopped = check_focal_length(walk.pairs(), {}, run);
  EXPECT_TRUE(stopped.interrupted);
  EXPECT_FALSE(stopped.is_observed);
  EXPECT_EQ(stopped.ratio, 1);
}

}  // namespace
}  // namespace hm
