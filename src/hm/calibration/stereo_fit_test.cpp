#include "hm/calibration/stereo_fit.hpp"

#include <gmock/gmock.h>

#include "hm/calibration/calibration_test_support.hpp"

namespace hm {
namespace {

using namespace testing_calibration;

const BoardParams kStereoBoard{BoardKind::kCheckerboard, 8, 6, 0.03, 0.75};

std::vector<BoardPair> pairs_of(int count, double sigma_px, std::uint64_t seed) {
  Rng rng(seed);
  std::vector<BoardPair> pairs;
  for (int i = 0; i < count; ++i) {
    const SE3 T_color_board = random_pose(kColorCamera, kStereoBoard, rng.uniform(0.4, 0.9), rng);
    pairs.push_back(
        {seen_by(kDepthCamera, kStereoBoard, kT_color_depth.inverse() * T_color_board, sigma_px, rng),
         seen_by(kColorCamera, kStereoBoard, T_color_board, sigma_px, rng)});
  }
  return pairs;
}

TEST(StereoFit, ExactCornersGiveTheMotion) {
  const auto fit = fit_stereo(pairs_of(6, 0, 1), kStereoBoard, kDepthCamera, kColorCamera);
  ASSERT_TRUE(fit) << to_string(fit.error());
  EXPECT_LT((fit->T_color_depth.translation() - kT_color_depth.translation()).norm(), 1e-7);
  EXPECT_LT((fit->T_color_depth.inverse() * kT_color_depth).angle(), 1e-6);
}

TEST(StereoFit, DeviationsAreHonest) {
  double squares = 0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const auto fit = fit_stereo(pairs_of(8, 0.1, seed), kStereoBoard, kDepthCamera, kColorCamera);
    ASSERT_TRUE(fit);
    const Vec3 error = fit->T_color_depth.translation() - kT_color_depth.translation();
    for (int axis = 0; axis < 3; ++axis, ++count)
      squares += std::pow(error[axis] / fit->translation_sigma_m[axis], 2);
    EXPECT_NEAR(fit->rms_px, 0.1 * std::sqrt(2.0), 0.02);
  }
  EXPECT_GT(squares / count, 0.4);
  EXPECT_LT(squares / count, 2.2);
}

TEST(StereoFit, PairsNumberedFromDifferentEndsAreTurned) {
  auto pairs = pairs_of(6, 0.02, 3);
  for (std::size_t i = 0; i < pairs.size(); i += 2)
    pairs[i].color_camera = turned_by_half(pairs[i].color_camera, kStereoBoard);
  const auto fit = fit_stereo(pairs, kStereoBoard, kDepthCamera, kColorCamera);
  ASSERT_TRUE(fit);
  EXPECT_LT((fit->T_color_depth.translation() - kT_color_depth.translation()).norm(), 3e-4);
}

TEST(StereoFit, ABoardThatMovedBetweenTheTwoPicturesIsLeftOut) {
  auto pairs = pairs_of(10, 0.05, 4);
  for (Vec2& pixel : pairs[7].color_camera.pixels) pixel += Vec2(12, 4);
  const auto fit = fit_stereo(pairs, kStereoBoard, kDepthCamera, kColorCamera);
  ASSERT_TRUE(fit);
  for (std::size_t i = 0; i < pairs.size(); ++i) EXPECT_EQ(fit->pairs[i].is_outlier, i == 7) << i;
  EXPECT_LT((fit->T_color_depth.translation() - kT_color_depth.translation()).norm(), 5e-4);
}

/// Slightly wrong intrinsics are corrected from the pairs if refinement is enabled.
TEST(StereoFit, RefinesIntrinsicsWhenAsked) {
  PinholeCamera off = kDepthCamera;
  off.fx *= 1.004, off.fy *= 1.004, off.cx += 1.5;
  StereoFitParams params;
  params.refine = StereoRefine::kIntrinsicsToo;
  const auto pairs = pairs_of(12, 0.02, 5);
  const auto refined = fit_stereo(pairs, kStereoBoard, off, kColorCamera, params);
  ASSERT_TRUE(refined);
  EXPECT_NEAR(refined->depth_camera.fx, kDepthCamera.fx, 0.3);
  EXPECT_NEAR(refined->depth_camera.cx, kDepthCamera.cx, 0.3);
  const auto fixed = fit_stereo(pairs, kStereoBoard, off, kColorCamera);
  ASSERT_TRUE(fixed);
  EXPECT_EQ(fixed->depth_camera.fx, off.fx);
  EXPECT_GT(fixed->rms_px, 2 * refined->rms_px);
}

TEST(StereoFit, NoPairIsAnError) {
  EXPECT_FALSE(fit_stereo({}, kStereoBoard, kDepthCamera, kColorCamera));
  const std::vector<BoardPair> empty(3);
  EXPECT_FALSE(fit_stereo(empty, kStereoBoard, kDepthCamera, kColorCamera));
}

}  // namespace
}  // namespace hm
