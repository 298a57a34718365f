#include "hm/pipeline/common/scene_level.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/core/angle.hpp"
#include "hm/core/rng.hpp"

namespace hm {
namespace {

PinholeCamera kinect() {
  PinholeCamera camera;
  camera.width = 640, camera.height = 480;
  camera.fx = camera.fy = 525, camera.cx = 319.5, camera.cy = 239.5;
  return camera;
}

/// Depth image of the inside of a room of 5 x 4 x 2.6 m with a table top, with the noise of structured light.
RgbdFrame seen_from(const SE3& T_world_camera, const PinholeCamera& camera, Rng& rng) {
  RgbdFrame frame;
  frame.depth.units = Image<std::uint16_t>(camera.width, camera.height, 0);
  const Vec3 low(-2.5, -2, 0), high(2.5, 2, 2.6), eye = T_world_camera.translation();
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Vec3 ray = T_world_camera.rotation() * camera.unproject(Vec2(x, y), 1);
      double depth_m = 1e9;
      for (int k = 0; k < 3; ++k)
        if (ray[k] != 0) depth_m = std::min(depth_m, ((ray[k] > 0 ? high[k] : low[k]) - eye[k]) / ray[k]);
      const double table_m = (0.75 - eye.z()) / ray.z();
      const Vec3 hit = eye + table_m * ray;
      if (table_m > 0 && hit.x() > 0.5 && hit.x() < 1.7 && std::abs(hit.y()) < 0.6)
        depth_m = std::min(depth_m, table_m);
      depth_m += rng.normal(0, 0.0015 * depth_m * depth_m);
      frame.depth.units(x, y) = static_cast<std::uint16_t>(std::clamp(depth_m * 1000, 0.0, 65535.0));
    }
  return frame;
}

/// At (-1.5, 0, 1.4), looking this much down, rolled.
SE3 pose_of(double yaw_deg, double down_deg, double roll_deg) {
  return {so3_exp(Vec3(0, 0, yaw_deg * kRadiansPerDegree)) *
              so3_exp(Vec3(0, down_deg * kRadiansPerDegree, 0)) * level_pose(-Vec3::UnitY()).rotation() *
              so3_exp(Vec3(0, 0, roll_deg * kRadiansPerDegree)),
          Vec3(-1.5, 0, 1.4)};
}

double angle_deg(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * kDegreesPerRadian;
}

TEST(SceneLevel, OneImageOfARoomTellsHowTheCameraIsHeld) {
  const PinholeCamera camera = kinect();
  Rng rng(1);
  for (const double down_deg : {5.0, 25.0, 35.0})
    for (const double roll_deg : {-8.0, 0.0, 12.0}) {
      const SE3 T_world_camera = pose_of(20, down_deg, roll_deg);
      const SE3 start = level_start(seen_from(T_world_camera, camera, rng), {camera, nullptr});
      EXPECT_LT(angle_deg(start.rotation().transpose().col(2), T_world_camera.rotation().transpose().col(2)),
                1.0)
          << down_deg << " " << roll_deg;
      EXPECT_NEAR(start.rotation()(1, 2), 0, 1e-9);  // looks along x
      EXPECT_EQ(start.translation(), Vec3::Zero());
    }
}

/// Camera frames with the y axis up (ICL-NUIM) are not taken for cameras that are turned over.
TEST(SceneLevel, ACameraWhoseYAxisPointsUp) {
  PinholeCamera camera = kinect();
  camera.fy = -camera.fy;
  Rng rng(2);
  Mat3 flip = Vec3(-1, -1, 1).asDiagonal();
  const SE3 upright = pose_of(0, 25, 3);
  const SE3 T_world_camera(upright.rotation() * flip, upright.translation());
  const SE3 start = level_start(seen_from(T_world_camera, camera, rng), {camera, nullptr});
  EXPECT_LT(angle_deg(start.rotation().transpose().col(2), T_world_camera.rotation().transpose().col(2)),
            1.0);
}

TEST(SceneLevel, ImagesOnAPathTellUpInItsFrame) {
  const PinholeCamera camera = kinect();
  Rng rng(3);
  const SE3 T_map_world(so3_exp(Vec3(1.9, 0.4, -0.3)), Vec3(1, 2, 3));
  std::vector<SurfacePatch> patches;
  Trajectory path;
  for (int i = 0; i < 8; ++i) {
    const SE3 T_world_camera = pose_of(-40 + 12 * i, 20, 2);
    const RgbdFrame frame = seen_from(T_world_camera, camera, rng);
    path.push_back({Time::from_seconds(i), T_map_world * T_world_camera});
    for (const SurfacePatch& patch : patches_of({frame, path.back().T_world_base}, camera))
      patches.push_back(patch);
  }
  const UpDirection up = find_up(patches, path, {camera, nullptr});
  ASSERT_EQ(up.source, UpSource::kFloorAndWalls);
  EXPECT_LT(angle_deg(up.up, T_map_world.rotation().col(2)), 0.3);
}

TEST(SceneLevel, AWallStraightAheadLeavesItUnknown) {
  const PinholeCamera camera = kinect();
  RgbdFrame wall;
  wall.depth.units = Image<std::uint16_t>(camera.width, camera.height, 1500);
  const SE3 start = level_start(wall, {camera, nullptr});
  EXPECT_LT(angle_deg(start.rotation().transpose().col(2), -Vec3::UnitY()), 1e-6);
  const UpDirection up = find_up(patches_of({wall, SE3()}, camera), {{Time(), SE3()}}, {camera, nullptr});
  EXPECT_FALSE(up.known());
  RgbdFrame nothing;
  nothing.depth.units = Image<std::uint16_t>(camera.width, camera.height, 0);
  EXPECT_TRUE(patches_of({nothing, SE3()}, camera).empty());
}

}  // namespace
}  // namespace hm
