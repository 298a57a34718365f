#include "hm/pipeline/checks/image_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace hm {
namespace {

const PinholeCamera kWallCamera{320, 240, 260, 260, 159.5, 119.5, {}};
constexpr double kWall_m = 2;
constexpr double kDegree_rad = std::numbers::pi / 180;

/// A wall at 2 m whose brightness changes smoothly and never repeats, seen by a camera at this pose.
RgbdFrame wall_seen_from(const SE3& T_world_camera, double contrast = 100, double shading = 0) {
  RgbdFrame frame;
  frame.T_world_camera = T_world_camera;
  frame.depth = {Image<std::uint16_t>(kWallCamera.width, kWallCamera.height), 1e-4};
  frame.color = Image<Rgb8>(kWallCamera.width, kWallCamera.height);
  for (int y = 0; y < kWallCamera.height; ++y)
    for (int x = 0; x < kWallCamera.width; ++x) {
      const Vec3 along = T_world_camera.rotation() * kWallCamera.unproject(Vec2(x, y), 1);
      const double reach = (kWall_m - T_world_camera.translation().z()) / along.z();
      const Vec3 at = T_world_camera.translation() + reach * along;
      frame.depth.units(x, y) = static_cast<std::uint16_t>(std::lround(reach / 1e-4));
      const double wave =
          std::sin(23 * at.x() + 2 * std::sin(9 * at.y())) + std::sin(29 * at.y() + 6 * at.x() * at.x());
      const double from_middle = std::hypot(x - kWallCamera.cx, y - kWallCamera.cy) / kWallCamera.cx;
      const double shade = 1 - shading * from_middle * from_middle;
      const auto gray = static_cast<std::uint8_t>(std::lround(shade * (128 + 0.4 * contrast * wave)));
      frame.color(x, y) = {gray, gray, gray};
    }
  return frame;
}

SE3 turned(double degrees) { return SE3(so3_exp(Vec3(0, 0, degrees * kDegree_rad)), Vec3::Zero()); }

TEST(ImageMotion, IsNoneWhereThePosesAreRight) {
  const SE3 there(so3_exp(Vec3(0.05, -0.08, 0.2)), Vec3(0.1, 0.05, -0.1));
  const auto motion = image_motion(wall_seen_from(SE3()), wall_seen_from(there), kWallCamera);
  ASSERT_TRUE(motion);
  EXPECT_EQ(motion->angle_rad(kWallCamera), 0);
  EXPECT_GT(motion->likeness, 0.95);
}

TEST(ImageMotion, FindsATurnAboutTheOpticalAxis) {
  for (const double degrees : {-6.0, 6.0, 10.5}) {
    RgbdFrame said = wall_seen_from(SE3());
    said.T_world_camera = turned(degrees);
    const auto motion = image_motion(wall_seen_from(SE3()), said, kWallCamera);
    ASSERT_TRUE(motion);
    EXPECT_NEAR(motion->turn_rad, degrees * kDegree_rad, 1e-9);
    EXPECT_NEAR(motion->angle_rad(kWallCamera), std::abs(degrees) * kDegree_rad, 1e-9);
    EXPECT_GT(motion->likeness - motion->unmoved_likeness, 0.05);
  }
}

TEST(ImageMotion, FindsAShiftAlongTheWallThatDepthDoesNotShow) {
  RgbdFrame said = wall_seen_from(SE3());
  said.T_world_camera = SE3(Mat3::Identity(), Vec3(0, 0.15, 0));
  const auto motion = image_motion(wall_seen_from(SE3()), said, kWallCamera);
  ASSERT_TRUE(motion);
  EXPECT_NEAR(motion->shift_px.y(), 0.15 * kWallCamera.fy / kWall_m, 2);
  EXPECT_EQ(motion->turn_rad, 0);
}

TEST(ImageMotion, ABlankWallShowsNothingAndNoColorIsNoMotion) {
  RgbdFrame said = wall_seen_from(SE3(), 0);
  said.T_world_camera = turned(6);
  const auto blank = image_motion(wall_seen_from(SE3(), 0), said, kWallCamera);
  ASSERT_TRUE(blank);
  EXPECT_EQ(blank->likeness, 0);
  said.color = {};
  EXPECT_FALSE(image_motion(wall_seen_from(SE3()), said, kWallCamera));
}

TEST(ImageMotion, AShadingThatMovesWithTheCameraIsNoMotionOfAFaintWall) {
  const SE3 there(so3_exp(Vec3(0, 0, 0.1)), Vec3(0.2, 0, 0));
  const auto motion =
      image_motion(wall_seen_from(SE3(), 15, 0.3), wall_seen_from(there, 15, 0.3), kWallCamera);
  ASSERT_TRUE(motion);
  EXPECT_EQ(motion->angle_rad(kWallCamera), 0);
}

TEST(ImageMotion, ImagesThatShareTooLittleAreNotCompared) {
  RgbdFrame away = wall_seen_from(SE3());
  away.T_world_camera = SE3(Mat3::Identity(), Vec3(3, 0, 0));
  EXPECT_FALSE(image_motion(wall_seen_from(SE3()), away, kWallCamera));
}

}  // namespace
}  // namespace hm
