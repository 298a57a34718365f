// Borders of volumes: welding, shared bits, open edges.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "hm/mesh/marching_cubes.hpp"
#include "hm/mesh/mesh_test_support.hpp"
#include "hm/mesh/whole_mesh.hpp"

namespace hm {
namespace {

using Place = std::array<std::int64_t, 3>;

Place place_of(const testing::EdgeId& edge, std::uint16_t fraction) {
  Place place{edge.low[0] * 65536L, edge.low[1] * 65536L, edge.low[2] * 65536L};
  place[static_cast<std::size_t>(edge.axis)] += fraction;
  return place;
}
Place place_of(const Eigen::Vector3f& vertex, double voxel_size_m) {
  Place place{};
  for (int i = 0; i < 3; ++i)
    place[static_cast<std::size_t>(i)] =
        std::llround((static_cast<double>(vertex[i]) / voxel_size_m - 0.5) * 65536);
  return place;
}
bool near(const Place& a, const Place& b) {
  for (std::size_t i = 0; i < 3; ++i)
    if (std::abs(a[i] - b[i]) > 2) return false;  // the rounding to float
  return true;
}

TEST(Seams, EqualsTheSlowMesherOverAllVolumes) {
  for (const double unknown_ratio : {0.0, 0.03, 0.3}) {
    VolumeGrid grid(0.02, 1e-5);
    Rng rng(11);
    testing::fill_noise(grid, rng, {-13, 14, unknown_ratio, 0.5});
    const TriangleMesh mesh = extract_mesh(grid, MeshParams{}, ParallelLoop(1));
    const testing::ReferenceMesher reference(grid, 1);
    std::map<testing::EdgeId, testing::ReferenceVertex> vertices;
    std::vector<std::array<testing::EdgeId, 3>> triangles;
    for (const VolumeKey key : grid.sorted_keys()) {
      const testing::ReferenceMesh part = reference.mesh(key);
      vertices.insert(part.vertices.begin(), part.vertices.end());
      triangles.insert(triangles.end(), part.triangles.begin(), part.triangles.end());
    }
    ASSERT_EQ(mesh.vertices.size(), vertices.size());
    ASSERT_EQ(mesh.triangles.size(), triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const testing::ReferenceVertex& expected = vertices.at(triangles[t][k]);
        const std::uint32_t index = mesh.triangles[t][k];
        ASSERT_TRUE(near(place_of(mesh.vertices[index], 0.02), place_of(triangles[t][k], expected.fraction)));
        ASSERT_EQ(mesh.colors[index], expected.color);
        ASSERT_EQ(mesh.normals[index], unpack_normal(expected.normal));
      }
  }
}

TEST(Seams, BorderVerticesHaveTheSameBitsInEveryVolume) {
  VolumeGrid grid(0.02, 1e-5);
  Rng rng(6);
  testing::fill_noise(grid, rng, {-13, 14, 0.0, 0.5});
  const TriangleMesh whole = extract_mesh(grid, MeshParams{}, ParallelLoop(1));
  std::map<std::array<float, 3>, std::size_t> place;
  for (std::size_t i = 0; i < whole.vertices.size(); ++i)
    place[{whole.vertices[i].x(), whole.vertices[i].y(), whole.vertices[i].z()}] = i;
  std::size_t shared = 0;
  for (const VolumeKey key : grid.sorted_keys()) {
    const TriangleMesh part = unpack(mesh_volume(grid, *grid.find(key), 1), 0.02);
    for (std::size_t i = 0; i < part.vertices.size(); ++i) {
      const auto found = place.find({part.vertices[i].x(), part.vertices[i].y(), part.vertices[i].z()});
      ASSERT_NE(found, place.end());
      ASSERT_EQ(part.normals[i], whole.normals[found->second]);
      ASSERT_EQ(part.colors[i], whole.colors[found->second]);
      ++shared;
    }
  }
  EXPECT_GT(shared, whole.vertices.size() * 11 / 10);
}

/// Lattice edge of a vertex.
testing::EdgeId edge_of(const Eigen::Vector3f& vertex, double voxel_size_m) {
  const Vec3 at = vertex.cast<double>() / voxel_size_m - Vec3::Constant(0.5);
  testing::EdgeId edge;
  (at.array() - at.array().round()).abs().maxCoeff(&edge.axis);
  for (int i = 0; i < 3; ++i)
    edge.low[static_cast<std::size_t>(i)] =
        static_cast<int>(i == edge.axis ? std::floor(at[i]) : std::round(at[i]));
  return edge;
}

/// The low corners of the four cubes around an edge.
std::set<testing::Lattice> cubes_around(const testing::EdgeId& edge) {
  std::set<testing::Lattice> cubes;
  const int first = (edge.axis + 1) % 3, second = (edge.axis + 2) % 3;
  for (int i = 0; i < 4; ++i)
    cubes.insert(testing::step(testing::step(edge.low, first, -(i & 1)), second, -(i >> 1)));
  return cubes;
}

bool is_observed(const VolumeGrid& grid, const testing::Lattice& cube) {
  for (int corner = 0; corner < 8; ++corner) {
    const testing::Lattice at{cube[0] + (corner & 1), cube[1] + (corner >> 1 & 1), cube[2] + (corner >> 2)};
    if (testing::voxel_at(grid, at).weight() == 0) return false;
  }
  return true;
}

TEST(Seams, EdgesAreOpenOnlyWhereObservedSpaceEnds) {
  VolumeGrid grid(0.02, 1e-5);
  Rng rng(21);
  testing::fill_noise(grid, rng, {-20, 21, 0.01, 0.0});
  const TriangleMesh mesh = extract_mesh(grid, MeshParams{}, ParallelLoop(1));
  const auto open = open_edges(mesh);
  ASSERT_GT(open.size(), 1000U);
  for (const auto& [a, b] : open) {
    const auto of_a = cubes_around(edge_of(mesh.vertices[a], 0.02));
    std::size_t both = 0, unobserved = 0;
    for (const testing::Lattice& cube : cubes_around(edge_of(mesh.vertices[b], 0.02)))
      if (of_a.count(cube)) ++both, unobserved += is_observed(grid, cube) ? 0U : 1U;
    ASSERT_EQ(both, 2U);  // the edge lies in the face between two cubes
    ASSERT_EQ(unobserved, 1U);
  }
}

}  // namespace
}  // namespace hm
