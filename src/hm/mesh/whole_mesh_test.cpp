#include "hm/mesh/whole_mesh.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "hm/core/testing/sanitized.hpp"
#include "hm/mesh/mesh_test_support.hpp"

namespace hm {
namespace {

TriangleMesh mesh_of(double voxel_size_m, int radius_voxels,
                     const std::function<double(const Vec3&)>& distance_m) {
  VolumeGrid grid(voxel_size_m, 2e-5);
  testing::fill(grid, -radius_voxels, radius_voxels, distance_m);
  return extract_mesh(grid, MeshParams{}, ParallelLoop(2));
}

double sphere(const Vec3& p) { return (p - Vec3(0.011, -0.007, 0.003)).norm() - 0.25; }
double torus(const Vec3& p) { return std::hypot(std::hypot(p.x(), p.y()) - 0.2, p.z() - 0.013) - 0.08; }
double box(const Vec3& p) {
  const Vec3 q = (p - Vec3(0.003, 0.004, 0.005)).cwiseAbs() - Vec3(0.2, 0.15, 0.1);
  return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);
}

/// Checks that every directed edge occurs once and has one opposite: closed, manifold, consistently oriented.
void expect_closed_and_oriented(const TriangleMesh& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      ASSERT_NE(t[k], t[(k + 1) % 3]);
      ASSERT_TRUE(edges.emplace(t[k], t[(k + 1) % 3]).second) << "an edge is used twice in one direction";
    }
  for (const auto& [a, b] : edges) ASSERT_TRUE(edges.count({b, a})) << "an edge is open";
}

/// Checks that no two vertices coincide and that each one is used.
void expect_distinct_used_vertices(const TriangleMesh& mesh) {
  std::set<std::array<float, 3>> places;
  for (const auto& v : mesh.vertices) ASSERT_TRUE(places.insert({v.x(), v.y(), v.z()}).second);
  std::set<std::uint32_t> used;
  for (const auto& t : mesh.triangles) used.insert(t.begin(), t.end());
  ASSERT_EQ(used.size(), mesh.vertices.size());
}

std::ptrdiff_t euler_characteristic(const TriangleMesh& mesh) {
  const auto faces = static_cast<std::ptrdiff_t>(mesh.triangles.size());
  return static_cast<std::ptrdiff_t>(mesh.vertices.size()) - faces * 3 / 2 + faces;
}

TEST(WholeMesh, ClosedShapesHaveTheRightTopology) {
  struct Case {
    double (*distance_m)(const Vec3&);
    std::ptrdiff_t euler;
  };
  for (const Case& c : {Case{sphere, 2}, Case{torus, 0}, Case{box, 2}}) {
    const TriangleMesh mesh = mesh_of(0.02, 17, c.distance_m);
    EXPECT_GT(mesh.triangles.size(), 1000U);
    expect_closed_and_oriented(mesh);
    expect_distinct_used_vertices(mesh);
    EXPECT_TRUE(open_edges(mesh).empty());
    EXPECT_EQ(euler_characteristic(mesh), c.euler);
  }
}

TEST(WholeMesh, AreaAndVolumeConverge) {
  const double area = 4 * M_PI * 0.25 * 0.25, volume = area * 0.25 / 3;
  double previous_area = 1, previous_volume = 1;
  for (const int n : {9, 18, 36}) {
    const TriangleMesh mesh = mesh_of(0.3 / n, n, sphere);
    const double area_error = std::abs(surface_area(mesh) / area - 1);
    const double volume_error = std::abs(enclosed_volume(mesh) / volume - 1);
    EXPECT_LT(area_error, 0.4 * previous_area) << n;  // of second order: a quarter each time
    EXPECT_LT(volume_error, 0.4 * previous_volume) << n;
    previous_area = area_error, previous_volume = volume_error;
  }
  EXPECT_LT(previous_area, 1e-3);
  EXPECT_LT(previous_volume, 1e-3);
  const TriangleMesh torus_mesh = mesh_of(0.01, 30, torus);
  EXPECT_NEAR(surface_area(torus_mesh) / (4 * M_PI * M_PI * 0.2 * 0.08), 1.0, 0.01);
  EXPECT_NEAR(enclosed_volume(torus_mesh) / (2 * M_PI * M_PI * 0.2 * 0.08 * 0.08), 1.0, 0.01);
  EXPECT_NEAR(enclosed_volume(mesh_of(0.01, 25, box)) / (8 * 0.2 * 0.15 * 0.1), 1.0, 0.01);
}

TEST(WholeMesh, VerticesLieOnTheSurfaceWithItsNormals) {
  const TriangleMesh mesh = mesh_of(0.02, 17, sphere);
  const Eigen::Vector3f center(0.011F, -0.007F, 0.003F);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3f radial = mesh.vertices[i] - center;
    ASSERT_NEAR(radial.norm(), 0.25F, 3e-4F);  // linear interpolation over 2 cm on this radius: 0.2 mm
    ASSERT_NEAR(mesh.normals[i].norm(), 1.0F, 1e-5F);
    ASSERT_GT(mesh.normals[i].dot(radial.normalized()), std::cos(0.02)) << i;  // code 0.95 deg and curvature
  }
}

TEST(WholeMesh, APlaneIsExact) {
  VolumeGrid grid(0.02, 1e-5);
  const Vec3 normal = Vec3(0.3, -0.5, 0.8).normalized();
  testing::fill(grid, -20, 20, [&](const Vec3& p) { return normal.dot(p) - 0.0123; });
  const TriangleMesh mesh = extract_mesh(grid, MeshParams{}, ParallelLoop(1));
  EXPECT_FALSE(mesh.has_colors());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    ASSERT_NEAR(normal.dot(mesh.vertices[i].cast<double>()), 0.0123, 3e-5);  // units and the edge margin
    ASSERT_GT(mesh.normals[i].cast<double>().dot(normal), std::cos(0.012));
  }
}

TEST(WholeMesh, NoiseIsManifoldToo) {
  // Every case of the table side by side, closed off by a shell of outside voxels.
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    VolumeGrid grid(0.02, 1e-5);
    Rng rng(seed);
    const int half = 14;
    testing::for_each_voxel(-half, half, [&](testing::Lattice at) {
      const bool shell = *std::min_element(at.begin(), at.end()) == -half ||
                         *std::max_element(at.begin(), at.end()) == half - 1;
      const auto sdf = static_cast<std::int16_t>(static_cast<int>(rng.below(2001)) - 1000);
      testing::set_voxel(grid, at, TsdfVoxel::make(shell ? 1000 : sdf, kWeightOne));
    });
    const TriangleMesh mesh = extract_mesh(grid, MeshParams{}, ParallelLoop(1));
    EXPECT_GT(mesh.triangles.size(), 30000U);
    expect_closed_and_oriented(mesh);
    expect_distinct_used_vertices(mesh);
  }
}

TEST(WholeMesh, ZerosAndFarFromTheOriginStayDistinct) {
  // Distances of exactly zero put vertices next to voxels from all sides; 80 m away floats are coarse.
  VolumeGrid grid(0.02, 1e-5);
  const Vec3 center = (Vec3(4004, 4004, 4004) + Vec3::Constant(0.5)) * 0.02;
  testing::fill(grid, 3994, 4015, [&](const Vec3& p) { return (p - center).lpNorm<1>() - 0.12; });
  const TriangleMesh mesh = extract_mesh(grid, MeshParams{}, ParallelLoop(1));
  expect_closed_and_oriented(mesh);
  expect_distinct_used_vertices(mesh);
  EXPECT_EQ(euler_characteristic(mesh), 2);
}

TEST(WholeMesh, SameBitsForAnyNumberOfThreads) {
  VolumeGrid grid(0.02, 1e-5);
  Rng rng(5);
  const int half = test::repetitions(30, 20);
  testing::fill_noise(grid, rng, {-half, half, 0.02, 0.5});
  const TriangleMesh one = extract_mesh(grid, MeshParams{}, ParallelLoop(1));
  for (int run = 0; run < 3; ++run) {
    const TriangleMesh two = extract_mesh(grid, MeshParams{}, ParallelLoop(2));
    EXPECT_EQ(one.vertices, two.vertices);
    EXPECT_EQ(one.normals, two.normals);
    EXPECT_EQ(one.colors, two.colors);
    EXPECT_EQ(one.triangles, two.triangles);
  }
}

TEST(WholeMesh, ColoursAreInterpolatedAndMissingOnesGrey) {
  VolumeGrid grid(0.02, 1e-5);
  testing::fill(grid, -8, 8, [](const Vec3& p) { return p.z() - 0.015; });  // half way between z = 0 and 1
  for (int y = -8; y < 8; ++y)
    for (int x = -8; x < 8; ++x) {
      if (x < 4) testing::set_color(grid, {x, y, 0}, ColorVoxel::make(10, 100, 200, 1));
      if (x < 0) testing::set_color(grid, {x, y, 1}, ColorVoxel::make(50, 60, 0, 9));
    }
  const TriangleMesh mesh = extract_mesh(grid, MeshParams{}, ParallelLoop(1));
  // z = 0.015 is a quarter of the way from the voxel centre at 0.01 to the one at 0.03.
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const float x = mesh.vertices[i].x();
    const Rgb8 expected = x < 0 ? Rgb8{20, 90, 150} : x < 0.08F ? Rgb8{10, 100, 200} : kNeutralColor;
    ASSERT_EQ(mesh.colors[i], expected) << x;
  }
}

TEST(WholeMesh, ThinlyObservedVoxelsMakeNoSurface) {
  VolumeGrid grid(0.02, 1e-5);
  testing::fill(grid, -8, 8, [](const Vec3& p) { return p.z() - 0.015; });
  for (int y = -8; y < 8; ++y)
    for (int x = 0; x < 8; ++x) testing::set_voxel(grid, {x, y, 1}, TsdfVoxel::make(1500, 200));
  MeshParams params;
  params.min_weight_ratio = 0.9;  // 230 of 256
  const TriangleMesh mesh = extract_mesh(grid, params, ParallelLoop(1));
  ASSERT_FALSE(mesh.vertices.empty());
  for (const auto& v : mesh.vertices) ASSERT_LT(v.x(), 0);
}

TEST(WholeMesh, AnEmptyGridGivesAnEmptyMesh) {
  const TriangleMesh mesh = extract_mesh(VolumeGrid(0.02, 1e-5), MeshParams{}, ParallelLoop(1));
  EXPECT_TRUE(mesh.vertices.empty() && mesh.triangles.empty());
}

}  // namespace
}  // namespace hm
