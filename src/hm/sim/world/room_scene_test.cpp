#include "hm/sim/world/room_scene.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/core/rng.hpp"
#include "hm/sim/motion/walk.hpp"
#include "hm/sim/sensor/renderer.hpp"
#include "hm/sim/world/world.hpp"

namespace hm {
namespace {

Vec3 random_in_room(Rng& rng, double margin_m) {
  return {rng.uniform(-3 + margin_m, 3 - margin_m), rng.uniform(-2 + margin_m, 2 - margin_m),
          rng.uniform(margin_m, 2.8 - margin_m)};
}

Vec3 sdf_gradient(const Vec3& p) {
  constexpr double kStep = 1e-6;
  Vec3 gradient;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 step = kStep * Vec3::Unit(axis);
    gradient[axis] = (room_sdf(p + step) - room_sdf(p - step)) / (2 * kStep);
  }
  return gradient;
}

/// The distance along a unit ray to the closed-form surface, by sphere tracing.
double traced(const Vec3& origin, const Vec3& direction) {
  double t = 0;
  for (int i = 0; i < 2000; ++i) {
    const double distance = room_sdf(origin + t * direction);
    t += distance;
    if (distance < 1e-10) break;
  }
  return t;
}

TEST(RoomScene, SdfIsZeroOnTheMesh) {
  const TriangleMesh mesh = merged_mesh(make_room());
  Rng rng(3);
  for (int i = 0; i < 20000; ++i) {
    const auto& t = mesh.triangles[i < 5000 ? static_cast<std::size_t>(i) % 90
                                            : rng.below(static_cast<std::uint32_t>(mesh.triangles.size()))];
    const double root = std::sqrt(rng.uniform()), v = rng.uniform();
    const Vec3 p = (1 - root) * mesh.vertices[t[0]].cast<double>() +
                   root * (1 - v) * mesh.vertices[t[1]].cast<double>() +
                   root * v * mesh.vertices[t[2]].cast<double>();
    // Outer faces of the walls, and faces that lie on another solid, are zero too: both sides touch it.
    ASSERT_NEAR(room_sdf(p), 0, 1e-4) << p.transpose();
  }
}

TEST(RoomScene, SdfIsTheDistanceToTheMeshInFreeSpace) {
  const World room = make_room();
  const Renderer renderer(room);
  Rng rng(4);
  int free = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 p = random_in_room(rng, 0.01);
    const double distance = room_sdf(p);
    if (distance <= 0) continue;
    ++free;
    ASSERT_NEAR(renderer.clearance_m(p, 3.0), distance, 1e-4) << p.transpose();
  }
  EXPECT_GT(free, 4000);
}

TEST(RoomScene, SdfHasUnitGradientAndTheRightSign) {
  EXPECT_NEAR(room_sdf({0, 0, 1}), 1.0, 1e-12);            // the floor is nearest
  EXPECT_NEAR(room_sdf({-3.05, 0, 1}), -0.05, 1e-12);      // in the wall
  EXPECT_NEAR(room_sdf({0.5, -1.3, 0.45}), -0.45, 1e-12);  // in the middle of the ball
  EXPECT_LT(room_sdf({-1.1, 1.5, 0.1}), 0);                // in the ramp
  EXPECT_GT(room_sdf({-0.1, 1.2, 0.6}), 0);                // above its slope
  EXPECT_NEAR(room_sdf({0, 0, -1}), 1 - kRoomWall_m, 1e-12);
  Rng rng(5);
  int unit = 0;
  for (int i = 0; i < 2000; ++i) unit += std::abs(sdf_gradient(random_in_room(rng, 0.0)).norm() - 1) < 1e-5;
  EXPECT_GT(unit, 1980);  // all but points on a medial surface
}

TEST(RoomScene, MeshesAreClosedAndEncloseTheClosedFormVolume) {
  const World room = make_room();
  for (std::size_t i = 0; i < room.parts.size(); ++i) {
    const RoomPrimitive& solid = room_primitives()[i];
    EXPECT_TRUE(open_edges(room.parts[i].mesh).empty()) << solid.name;
    const Vec3& h = solid.half_m;
    double volume = 8 * h.prod();
    if (solid.shape == RoomShape::kShell) volume = 8 * ((h + Vec3::Constant(kRoomWall_m)).prod() - h.prod());
    if (solid.shape == RoomShape::kSphere) volume = 4.0 / 3 * M_PI * h.prod();
    if (solid.shape == RoomShape::kWedge) volume = 4 * h.prod();
    EXPECT_NEAR(enclosed_volume(room.parts[i].mesh), volume, 1e-3 * volume) << solid.name;
  }
}

TEST(RoomScene, RenderedDepthIsTheClosedForm) {
  const World room = make_room();
  const Renderer renderer(room);
  const PinholeCamera camera{160, 120, 120, 120, 79.5, 59.5, {}};
  const Walk walk = room_walk();
  std::size_t compared = 0, all = 0;
  for (int i = 0; i < 12; ++i) {
    const SE3 pose = walk.T_world_camera(walk.duration_s() * i / 12);
    const RenderedView view = renderer.render(camera, pose, ParallelLoop());
    for (int y = 0; y < camera.height; y += 3) {
      for (int x = 0; x < camera.width; x += 3) {
        ++all;
        const Vec3 ray = pose.rotation() * camera.unproject({x, y}, 1.0);
        const double distance = traced(pose.translation(), ray.normalized());
        const Vec3 hit = pose.translation() + distance * ray.normalized();
        // Every pixel lies on the surface; where it is not seen edge-on the depth is the closed form's.
        const double z = static_cast<double>(view.depth_m(x, y));
        ASSERT_NEAR(room_sdf(pose.translation() + z * ray), 0, 1e-4);
        const Vec3 normal = sdf_gradient(hit + 1e-5 * (pose.translation() - hit).normalized());
        const double cosine = -normal.normalized().dot(ray.normalized());
        if (cosine < 0.35) continue;
        ++compared;
        ASSERT_NEAR(z, distance / ray.norm(), 1e-4) << x << " " << y;
        ASSERT_NEAR(static_cast<double>(view.cos_incidence(x, y)), cosine, 0.02);
      }
    }
  }
  EXPECT_GT(compared, all * 8 / 10);
}

}  // namespace
}  // namespace hm
