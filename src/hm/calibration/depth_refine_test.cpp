#include "hm/calibration/depth_refine.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/calibration/board_motion.hpp"
#include "hm/calibration/calibration_test_support.hpp"
#include "hm/calibration/camera_fit.hpp"

namespace hm {
namespace {

using namespace testing_calibration;

const BoardParams kRefinedBoard;  // 9 x 6, 0.1 m

DepthGeometry truth() { return {kDepthCamera.without_distortion(), kColorCamera, kT_color_depth}; }

/// Initial geometry: focal lengths and principal points wrong by up to 0.4 %, the translation by a
/// millimetre.
DepthGeometry start() {
  DepthGeometry geometry = truth();
  geometry.color_camera.fx += 2, geometry.color_camera.fy += 2, geometry.color_camera.cx -= 1;
  geometry.depth_camera.fx -= 0.5, geometry.depth_camera.cy += 0.5;
  geometry.T_color_depth =
      SE3(so3_exp(Vec3(0.0005, -0.0003, 0.0002)), Vec3(0.001, -0.0005, 0.0005)) * geometry.T_color_depth;
  return geometry;
}

double bias_m(double x, double y, double z) {
  return 0.05 * (z / 4) * (z / 4) * (std::pow(x / 320 - 1, 2) - 0.5 * (y / 240 - 1));
}

/// Corners and readings of the true cameras, with poses and true depths according to `geometry`.
std::vector<DepthPose> poses_seen_with(const DepthGeometry& geometry, int count) {
  Rng rng(17);
  std::vector<DepthPose> poses;
  for (int i = 0; i < count; ++i) {
    const SE3 T_true = random_pose(kColorCamera, kRefinedBoard, 1.2 + 2.6 * i / count, rng);
    DepthPose pose;
    pose.view = seen_by(kColorCamera, kRefinedBoard, T_true, 0.05, rng);
    pose.T_color_board = *board_pose(pose.view, kRefinedBoard, geometry.color_camera);
    const SE3 T_depth_true = kT_color_depth.inverse() * T_true;
    const SE3 T_depth_believed = geometry.T_color_depth.inverse() * pose.T_color_board;
    const Vec2 middle =
        truth().depth_camera.project(T_depth_true * Vec3(0.5 * corner_on_board(kRefinedBoard, 53)));
    const double half = 0.25 * kDepthCamera.fx / T_depth_true.translation().z();
    for (double y = std::max(0.0, middle.y() - half); y < std::min(480.0, middle.y() + half); y += 2)
      for (double x = std::max(0.0, middle.x() - half); x < std::min(640.0, middle.x() + half); x += 2) {
        const Vec2 pixel(std::floor(x), std::floor(y));
        const double z = plane_depth_m(truth().depth_camera, T_depth_true, pixel);
        const double sigma = 0.0004 * z * z;
        pose.depth.samples.push_back(
            {static_cast<std::int16_t>(pixel.x()), static_cast<std::int16_t>(pixel.y()),
             static_cast<float>(z - bias_m(pixel.x(), pixel.y(), z) + rng.normal(0, sigma)),
             static_cast<float>(plane_depth_m(geometry.depth_camera, T_depth_believed, pixel)),
             static_cast<float>(sigma)});
      }
    poses.push_back(std::move(pose));
  }
  return poses;
}

DepthCorrectionModel fitted_to(const std::vector<DepthPose>& poses) {
  std::vector<DepthView> views;
  for (const DepthPose& pose : poses) views.push_back(pose.depth);
  return fit_depth_correction(views, 640, 480)->model;
}

TEST(DepthRefine, CamerasAreFoundTogetherWithTheCorrection) {
  const std::vector<DepthPose> poses = poses_seen_with(start(), 24);
  DepthFitParams params;
  params.prior_intrinsics_px = 3;
  const auto refined = refine_geometry(poses, kRefinedBoard, start(), fitted_to(poses), params);
  ASSERT_TRUE(refined) << to_string(refined.error());
  const DepthGeometry &found = refined->geometry, given = start(), wanted = truth();
  EXPECT_LT(std::abs(found.color_camera.fx - wanted.color_camera.fx),
            0.3 * std::abs(given.color_camera.fx - wanted.color_camera.fx));
  EXPECT_LT(std::abs(found.color_camera.cx - wanted.color_camera.cx), 0.5);
  EXPECT_LT(refined->corners_after, 0.7) << "corners are within their deviation";
  EXPECT_LT(refined->corners_after, refined->corners_before);
  EXPECT_LE(refined->depth_after, refined->depth_before);
  EXPECT_LT((found.T_color_depth.translation() - wanted.T_color_depth.translation()).norm(), 0.003);

  // Readings compared with the boards of the refined cameras: the bias is closer to the true one.
  const auto error_of = [](const DepthCorrectionModel& model) {
    double sum = 0;
    for (const double z : {1.5, 2.5, 3.5})
      for (int y = 60; y < 480; y += 60)
        for (int x = 80; x < 640; x += 80) {
          const double error = model.correction_m(Vec2(x, y), z - bias_m(x, y, z)) - bias_m(x, y, z);
          sum += error * error;
        }
    return std::sqrt(sum / (3 * 7 * 7));
  };
  const double before = error_of(fitted_to(poses)), after = error_of(fitted_to(poses_seen_with(found, 24)));
  EXPECT_LT(after, 0.6 * before) << before;
}

TEST(DepthRefine, KnownCamerasStay) {
  const std::vector<DepthPose> poses = poses_seen_with(truth(), 12);
  DepthFitParams params;
  params.prior_intrinsics_px = 1e-3, params.prior_translation_m = 1e-6, params.prior_rotation_rad = 1e-6;
  const auto refined = refine_geometry(poses, kRefinedBoard, truth(), fitted_to(poses), params);
  ASSERT_TRUE(refined);
  EXPECT_NEAR(refined->geometry.color_camera.fx, truth().color_camera.fx, 0.01);
  EXPECT_LT((refined->geometry.T_color_depth.inverse() * truth().T_color_depth).log().norm(), 1e-4);
}

TEST(DepthRefine, OnlySplinesAreAdjusted) {
  const std::vector<DepthPose> poses = poses_seen_with(truth(), 4);
  DepthCorrectionModel model = fitted_to(poses);
  model.mode = DepthFitMode::kQuadratic;
  const auto refined = refine_geometry(poses, kRefinedBoard, truth(), model);
  ASSERT_FALSE(refined);
  EXPECT_EQ(refined.error().code, ErrorCode::kUsage);
}

TEST(BoardMotion, TurnsAsTheGroupDoes) {
  Rng rng(2);
  for (const double size : {0.0, 1e-12, 1e-4, 0.3, 3.0}) {
    const SE3 T(so3_exp(size * Vec3(0.6, -0.48, 0.64)), Vec3(0.1, -2, 3));
    const Vec3 p(rng.normal(), rng.normal(), rng.normal());
    Vec3 moved;
    detail::move(detail::to_motion(T).data(), p.data(), moved.data());
    EXPECT_LT((moved - T * p).norm(), 1e-12) << size;
  }
}

}  // namespace
}  // namespace hm
