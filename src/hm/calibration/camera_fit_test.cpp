#include "hm/calibration/camera_fit.hpp"

#include <gmock/gmock.h>

#include "hm/calibration/calibration_test_support.hpp"

namespace hm {
namespace {

using namespace testing_calibration;
using testing::HasSubstr;

const BoardParams kBoard{BoardKind::kCheckerboard, 8, 6, 0.03, 0.75};

std::vector<BoardView> views_of(const PinholeCamera& camera, int count, double sigma_px, std::uint64_t seed) {
  Rng rng(seed);
  std::vector<BoardView> views;
  for (int i = 0; i < count; ++i)
    views.push_back(
        seen_by(camera, kBoard, random_pose(camera, kBoard, rng.uniform(0.4, 0.8), rng), sigma_px, rng));
  return views;
}

TEST(CameraFit, ExactCornersGiveTheCamera) {
  const auto fit = fit_camera(views_of(kColorCamera, 12, 0, 1), kBoard, 640, 480);
  ASSERT_TRUE(fit) << to_string(fit.error());
  EXPECT_NEAR(fit->camera.fx, kColorCamera.fx, 1e-2);
  EXPECT_NEAR(fit->camera.fy, kColorCamera.fy, 1e-2);
  EXPECT_NEAR(fit->camera.cx, kColorCamera.cx, 2e-2);
  EXPECT_NEAR(fit->camera.cy, kColorCamera.cy, 2e-2);
  EXPECT_NEAR(fit->camera.distortion.k1, kColorCamera.distortion.k1, 1e-3);
  EXPECT_LT(fit->rms_px, 1e-3);
}

/// Over seeds, errors agree with the estimated standard deviations.
TEST(CameraFit, DeviationsAreHonest) {
  double squares = 0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const auto fit = fit_camera(views_of(kDepthCamera, 12, 0.1, seed), kBoard, 640, 480);
    ASSERT_TRUE(fit);
    const std::array<double, 4> errors{fit->camera.fx - kDepthCamera.fx, fit->camera.fy - kDepthCamera.fy,
                                       fit->camera.cx - kDepthCamera.cx, fit->camera.cy - kDepthCamera.cy};
    for (std::size_t i = 0; i < 4; ++i, ++count) squares += std::pow(errors[i] / fit->sigma[i], 2);
    const double freedom = 1 - (9 + 6 * 12) / (2.0 * 12 * 48);  // reduced by the number of fitted parameters
    EXPECT_NEAR(fit->rms_px, 0.1 * std::sqrt(2 * freedom), 0.01);
  }
  EXPECT_GT(squares / count, 0.4);
  EXPECT_LT(squares / count, 2.0);
}

TEST(CameraFit, AMisdetectedBoardIsLeftOut) {
  auto views = views_of(kColorCamera, 14, 0.05, 3);
  for (std::size_t i = 0; i < views[4].size(); i += 2) views[4].pixels[i] += Vec2(7, -5);
  const auto fit = fit_camera(views, kBoard, 640, 480);
  ASSERT_TRUE(fit);
  for (std::size_t i = 0; i < views.size(); ++i) EXPECT_EQ(fit->views[i].is_outlier, i == 4) << i;
  EXPECT_NEAR(fit->camera.fx, kColorCamera.fx, 3);
  EXPECT_LT(fit->rms_px, 0.1);
}

TEST(CameraFit, PoorSetsAreToldInWords) {
  const auto few = fit_camera(views_of(kColorCamera, 4, 0.05, 5), kBoard, 640, 480);
  ASSERT_TRUE(few);
  EXPECT_THAT(few->warnings, testing::Contains(HasSubstr("only 4 images")));
  EXPECT_THAT(few->warnings, testing::Contains(HasSubstr("cover")));
  Rng rng(6);
  std::vector<BoardView> frontal;
  for (int i = 0; i < 12; ++i)
    frontal.push_back(seen_by(kColorCamera, kBoard,
                              SE3(so3_exp(Vec3(0.03 * rng.uniform(), 0.03 * rng.uniform(), 0.1 * i)),
                                  Vec3(rng.uniform(-0.1, 0), rng.uniform(-0.1, 0), rng.uniform(0.4, 0.6))),
                              0.05, rng));
  const auto flat = fit_camera(frontal, kBoard, 640, 480);
  ASSERT_TRUE(flat);
  EXPECT_THAT(flat->warnings, testing::Contains(HasSubstr("tilt")));
}

TEST(CameraFit, TooFewViewsAreAnError) {
  EXPECT_FALSE(fit_camera({}, kBoard, 640, 480));
  const auto two = fit_camera(views_of(kColorCamera, 2, 0, 1), kBoard, 640, 480);
  ASSERT_FALSE(two);
  EXPECT_THAT(two.error().message, HasSubstr("found in 2 images"));
}

TEST(BoardPose, IsThePoseThatWasProjected) {
  Rng rng(8);
  for (int i = 0; i < 20; ++i) {
    const SE3 truth = random_pose(kColorCamera, kBoard, rng.uniform(0.4, 1.5), rng);
    const auto pose = board_pose(seen_by(kColorCamera, kBoard, truth, 0, rng), kBoard, kColorCamera);
    ASSERT_TRUE(pose);
    EXPECT_LT((truth.inverse() * *pose).log().norm(), 1e-4);
  }
  BoardView line;
  for (int i = 0; i < 8; ++i) line.corners.push_back(i), line.pixels.emplace_back(100 + 10 * i, 50);
  line.corners.resize(3), line.pixels.resize(3);
  EXPECT_FALSE(board_pose(line, kBoard, kColorCamera));
}

}  // namespace
}  // namespace hm
