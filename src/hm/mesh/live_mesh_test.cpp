// The mesher with the real integrator: the reported changes are sufficient for an up-to-date mesh.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hm/mesh/incremental_mesher.hpp"
#include "hm/mesh/whole_mesh.hpp"
#include "hm/tsdf/integration/integrator.hpp"

namespace hm {
namespace {

/// View of a camera at `origin` along world +x: a wall at x = 2, a floor at z = -0.6, and a ball that moves
/// through the image from frame to frame, is carved at its old position, and leaves in the end.
RgbdFrame render(const PinholeCamera& camera, const Vec3& origin, int frame) {
  Mat3 rotation;
  rotation << -Vec3::UnitY(), -Vec3::UnitZ(), Vec3::UnitX();  // right, down, forward
  RgbdFrame result;
  result.depth = {Image<std::uint16_t>(camera.width, camera.height), 1e-4};
  result.color = Image<Rgb8>(camera.width, camera.height);
  result.T_world_camera = SE3(rotation, origin);
  const Vec3 to_ball = Vec3(1.3, frame < 9 ? -0.5 + 0.08 * frame : 50.0, 0.0) - origin;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Vec3 ray = rotation * camera.unproject(Vec2(x, y), 1.0);  // 1 along the optical axis
      double depth_m = (2.0 - origin.x()) / ray.x();
      if (ray.z() < 0) depth_m = std::min(depth_m, (-0.6 - origin.z()) / ray.z());
      const double middle = to_ball.dot(ray), a = ray.squaredNorm();
      const double inside = middle * middle - a * (to_ball.squaredNorm() - 0.25 * 0.25);
      if (inside > 0) depth_m = std::min(depth_m, (middle - std::sqrt(inside)) / a);
      result.depth.units(x, y) = static_cast<std::uint16_t>(std::lround(depth_m / 1e-4));
      result.color(x, y) = {static_cast<std::uint8_t>(2 * x), static_cast<std::uint8_t>(2 * y),
                            static_cast<std::uint8_t>(10 * frame)};
    }
  return result;
}

void follow_a_scan(IntegrationMethod method) {
  TsdfParams params;
  params.voxel_size_m = 0.04;
  params.method = method;
  params.carving_weight_ratio = 4;  // few frames: objects that have left must be carved soon
  const PinholeCamera camera{96, 72, 80, 80, 47.5, 35.5, {}};
  const ParallelLoop loop(1);
  Integrator integrator(params, DepthNoise{}, camera, loop);
  VolumeGrid grid = Integrator::make_grid(params);
  IncrementalMesher mesher(MeshParams{}, loop);
  std::size_t changed = 0, released = 0;
  for (int frame = 0; frame < 16; ++frame) {
    const ScanStats stats =
        integrator.integrate(grid, render(camera, Vec3(0.01 * frame, 0.02 * frame, 0.1), frame));
    ASSERT_EQ(stats.nothing_integrated_because, "");
    changed += stats.changed.size();
    released += stats.volumes_released;
    mesher.mark_changed(stats.changed);
    mesher.update(grid);
    const TriangleMesh live = mesher.whole_mesh(), scratch = extract_mesh(grid, MeshParams{}, loop);
    ASSERT_EQ(live.vertices, scratch.vertices) << "frame " << frame;
    ASSERT_EQ(live.normals, scratch.normals);
    ASSERT_EQ(live.colors, scratch.colors);
    ASSERT_EQ(live.triangles, scratch.triangles);
  }
  EXPECT_GT(mesher.vertex_count(), 3000U);
  EXPECT_GT(changed, 1000U);
  EXPECT_GT(released, 0U);
}

TEST(LiveMesh, FollowsProjectionWithCarving) { follow_a_scan(IntegrationMethod::kProjection); }
TEST(LiveMesh, FollowsTraversalWithCarving) { follow_a_scan(IntegrationMethod::kTraversal); }

}  // namespace
}  // namespace hm
