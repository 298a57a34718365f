#include "hm/pipeline/live/seen_share.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

constexpr double kVoxel_m = 0.02;

/// A square of the plane in which `axis` is `at_m`, from -half to half, by vertices a voxel apart.
TriangleMesh square(int axis, float at_m, float half_m) {
  TriangleMesh mesh;
  const auto count = static_cast<int>(std::round(2 * half_m / kVoxel_m));
  for (int i = 0; i <= count; ++i)
    for (int j = 0; j <= count; ++j) {
      Eigen::Vector3f vertex;
      vertex[axis] = at_m;
      vertex[(axis + 1) % 3] = -half_m + 0.02F * static_cast<float>(i);
      vertex[(axis + 2) % 3] = -half_m + 0.02F * static_cast<float>(j);
      mesh.vertices.push_back(vertex);
    }
  return mesh;
}

TEST(SurfaceCells, NoLineSlipsThroughASurface) {
  SurfaceCells surface(kVoxel_m);
  // Oblique, so that it cuts off every kind of corner.
  const Vec3 normal = Vec3(1, 0.37, -0.21).normalized();
  const Vec3 u = normal.unitOrthogonal(), v = normal.cross(u);
  TriangleMesh plane;
  for (int i = -150; i <= 150; ++i)
    for (int j = -150; j <= 150; ++j)
      plane.vertices.push_back((0.7 * normal + kVoxel_m * (i * u + j * v)).cast<float>());
  surface.mark(plane);
  Rng rng(3);
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec3 target = 0.7 * normal + rng.uniform(-1, 1) * u + rng.uniform(-1, 1) * v;
    EXPECT_TRUE(surface.is_hit(Vec3::Zero(), target.normalized(), 3));
  }
  EXPECT_FALSE(surface.is_hit(Vec3::Zero(), -normal, 3));
  EXPECT_FALSE(surface.is_hit(Vec3::Zero(), normal, 0.5));
}

TEST(SeenShare, CountsTheDirectionsThatEndOnASurface) {
  SeenShare seen;
  EXPECT_FALSE(seen.share());
  seen.count({{0, 0, 0}});
  seen.wait();
  EXPECT_FALSE(seen.share());  // without a mesh
  // Three sides of a cube around the place: half of all directions.
  for (int axis = 0; axis < 3; ++axis) seen.set_page({axis, 0, 0}, square(axis, 1, 1), kVoxel_m);
  seen.count({{0, 0, 0}});
  seen.wait();
  ASSERT_TRUE(seen.share());
  EXPECT_NEAR(*seen.share(), 0.5, 0.06);
  for (int axis = 0; axis < 3; ++axis) seen.set_page({axis, 1, 0}, square(axis, -1, 1), kVoxel_m);
  seen.count({{0, 0, 0}});
  seen.wait();
  EXPECT_EQ(*seen.share(), 1);
  // A side that is gone opens a sixth.
  seen.set_page({0, 0, 0}, {}, kVoxel_m);
  seen.count({{0, 0, 0}});
  seen.wait();
  EXPECT_NEAR(*seen.share(), 5.0 / 6, 0.04);
  seen.count({});
  seen.wait();
  EXPECT_FALSE(seen.share());
}

TEST(SeenShare, PlacesOfALongPathAreSpreadWider) {
  std::vector<Eigen::Vector3f> path;
  for (int i = 0; i < 5000; ++i) path.emplace_back(0.02F * static_cast<float>(i), 0, 0);
  EXPECT_EQ(places_along(path, 1, 200).size(), 100u);
  EXPECT_EQ(places_along(path, 1, 60).size(), 50u);
  path.insert(path.end(), path.rbegin(), path.rend());  // back the same way
  EXPECT_LE(places_along(path, 1, 200).size(), 101u);
}

}  // namespace
}  // namespace hm
