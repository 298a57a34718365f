#include "hm/sim/sensor/visibility.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hm/sim/motion/walk.hpp"
#include "hm/sim/sensor/renderer.hpp"
#include "hm/sim/world/room_scene.hpp"
#include "hm/sim/world/solids.hpp"

namespace hm {
namespace {

/// A large wall at x = 2 with a board of 0.4 x 0.4 m at x = 1 before it.
World wall_and_board(Reflectance board) {
  World world{"test", {}};
  world.parts.push_back({Material{}, {}});
  append_box(world.parts.back().mesh, {2, -5, -5}, {2.2, 5, 5});
  Material material;
  material.reflectance = board;
  world.parts.push_back({material, {}});
  append_box(world.parts.back().mesh, {1.0, -0.2, -0.2}, {1.02, 0.2, 0.2});
  return world;
}

VisibilityParams tango() {
  VisibilityParams params;
  params.camera = {320, 180, 260, 260, 159.5, 89.5, {}};
  params.spacing_m = 0.02;
  return params;
}

SE3 looking_along_x(const Vec3& position) {
  Mat3 rotation;
  rotation << Vec3(0, -1, 0), Vec3(0, 0, -1), Vec3(1, 0, 0);
  return {rotation, position};
}

TEST(Visibility, CountsTheAreaThatAViewShows) {
  const std::vector<SE3> poses = {looking_along_x({0, 0, 0})};
  const VisibilityParams params = tango();
  double wall = 0, board = 0;
  for (const bool returns : {true, false}) {
    const World world = wall_and_board(returns ? Reflectance::kNormal : Reflectance::kNoReturn);
    const SurfacePoints seen = visible_surface_points(world, poses, params, ParallelLoop());
    wall = board = 0;
    for (std::size_t i = 0; i < seen.positions.size(); ++i) {
      ASSERT_LT(seen.normals[i].x(), -0.99f);  // only what faces the camera
      (seen.positions[i].x() > 1.5f ? wall : board) += params.spacing_m * params.spacing_m;
    }
    // The footprint of the image at 2 m less the board's shadow, twice its size.
    const double footprint = 320.0 / 260 * 2 * 180.0 / 260 * 2;
    EXPECT_NEAR(wall, footprint - 0.8 * 0.8, 0.03 * footprint);
    EXPECT_NEAR(board, returns ? 0.16 : 0.0, 0.005);
  }
}

TEST(Visibility, RangeAndGrazingAnglesLimitWhatIsSeen) {
  const World world = wall_and_board(Reflectance::kNormal);
  VisibilityParams params = tango();
  params.max_depth_m = 1.5;
  const std::vector<SE3> poses = {looking_along_x({0, 0, 0})};
  for (const auto& p : visible_surface_points(world, poses, params, ParallelLoop()).positions)
    EXPECT_LT(p.x(), 1.5f);
  params.max_depth_m = 4;
  params.grazing_limit_rad = 0.2;
  for (const auto& p : visible_surface_points(world, poses, params, ParallelLoop()).positions)
    EXPECT_LT(std::hypot(p.y(), p.z()) / p.x(), std::tan(0.2f) + 1e-4f);
}

TEST(Visibility, FindsNearlyAllThatExhaustiveTestsFindAndNothingElse) {
  const World room = make_room();
  const Renderer renderer(room);
  const Walk walk = room_walk();
  std::vector<SE3> poses;
  for (int i = 0; i < 60; ++i) poses.push_back(walk.T_world_camera(walk.duration_s() * i / 60));
  VisibilityParams params = tango();
  params.spacing_m = 0.05;
  const ParallelLoop two(2);
  const SurfacePoints seen = visible_surface_points(room, poses, params, two);
  const auto visible_from = [&](const SE3& pose, const Vec3& p, const Vec3& normal) {
    const Vec3 local = pose.inverse() * p, way = pose.translation() - p;
    if (local.z() < params.min_depth_m || local.z() > params.max_depth_m) return false;
    if (!params.camera.contains(params.camera.project(local))) return false;
    if (normal.dot(way.normalized()) < std::cos(params.grazing_limit_rad)) return false;
    // The way is free when sphere tracing from just off the surface reaches the camera.
    double t = 0.003;
    while (t < way.norm()) {
      const double distance = room_sdf(p + t * way.normalized());
      if (distance < 1e-5) return false;
      t += distance;
    }
    return true;
  };
  for (std::size_t i = 0; i < seen.positions.size(); i += 7) {
    const Vec3 p = seen.positions[i].cast<double>(), n = seen.normals[i].cast<double>();
    ASSERT_NEAR(room_sdf(p), 0, 1e-4);
    ASSERT_TRUE(std::ranges::any_of(poses, [&](const SE3& pose) { return visible_from(pose, p, n); }))
        << p.transpose();
  }
  // The exhaustive count, over samples of the floor, the walls and the ceiling.
  std::size_t exhaustive = 0, found = 0;
  const double cell = params.spacing_m;
  for (double x = -2.99; x < 3; x += cell)
    for (double y = -1.99; y < 2; y += cell)
      for (const double z : {0.0, 2.8})
        exhaustive += std::ranges::any_of(poses, [&](const SE3& pose) {
          return visible_from(pose, {x, y, z}, {0, 0, z > 1 ? -1.0 : 1.0});
        });
  for (std::size_t i = 0; i < seen.positions.size(); ++i) {
    const float z = seen.positions[i].z(), up = seen.normals[i].z();
    found += (z < 1e-4f && up > 0.9f) || (z > 2.7999f && up < -0.9f);
  }
  EXPECT_NEAR(static_cast<double>(found), static_cast<double>(exhaustive),
              0.04 * static_cast<double>(exhaustive));
  const SurfacePoints again = visible_surface_points(room, poses, params, ParallelLoop());
  EXPECT_EQ(again.positions, seen.positions);
}

}  // namespace
}  // namespace hm
