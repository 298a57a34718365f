#include "hm/mesh/marching_cubes.hpp"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include "hm/mesh/mesh_test_support.hpp"

namespace hm {
namespace {

using testing::EdgeId;
using testing::ReferenceMesh;
using testing::ReferenceMesher;
using testing::ReferenceVertex;

/// Every vertex and triangle of a volume against the slow mesher, bit for bit.
void expect_equal(const VolumeMesh& mesh, const ReferenceMesh& expected, bool with_colors) {
  ASSERT_EQ(mesh.vertex_count(), expected.vertices.size());
  ASSERT_EQ(mesh.triangle_count(), expected.triangles.size());
  std::map<EdgeId, std::uint32_t> index;
  std::size_t i = 0;
  for (const auto& [edge, vertex] : expected.vertices) {
    ASSERT_EQ(mesh.fractions()[i], vertex.fraction) << i;
    ASSERT_EQ(mesh.normals()[i], vertex.normal) << i;
    if (with_colors) {
      ASSERT_EQ(mesh.colors()[i], vertex.color) << i;
    }
    index[edge] = static_cast<std::uint32_t>(i++);
  }
  const TriangleMesh unpacked = unpack(mesh, 0.02);
  ASSERT_EQ(unpacked.triangles.size(), expected.triangles.size());
  for (std::size_t t = 0; t < expected.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) ASSERT_EQ(unpacked.triangles[t][k], index[expected.triangles[t][k]]);
}

class MarchingCubes : public ::testing::TestWithParam<std::int64_t> {
 protected:
  void SetUp() override { hwy::SetSupportedTargetsForTest(GetParam()); }
  void TearDown() override { hwy::SetSupportedTargetsForTest(0); }
};

void check_noise(const testing::Noise& noise, int min_weight, std::uint64_t seed) {
  VolumeGrid grid(0.02, 1e-5);
  Rng rng(seed);
  testing::fill_noise(grid, rng, noise);
  const ReferenceMesher reference(grid, min_weight);
  std::size_t vertices = 0;
  for (const VolumeKey key : grid.sorted_keys()) {
    const VolumeMesh mesh = mesh_volume(grid, *grid.find(key), static_cast<std::uint16_t>(min_weight));
    EXPECT_EQ(mesh.key(), key);
    expect_equal(mesh, reference.mesh(key), mesh.has_colors());
    EXPECT_TRUE(mesh.has_colors() == (noise.color_ratio > 0) || mesh.empty());
    vertices += mesh.vertex_count();
  }
  EXPECT_GT(vertices, 500U);
}

TEST_P(MarchingCubes, EqualsTheSlowMesherOnNoise) {
  check_noise({}, 1, 1);
  check_noise({-9, 13, 0.0, 0.7}, 1, 2);
  check_noise({-4, 12, 0.2, 0.1}, 1, 3);
  check_noise({-9, 9, 0.02, 0.0}, 1, 4);
}

TEST_P(MarchingCubes, EqualsTheSlowMesherWithAWeightThreshold) { check_noise({-9, 13, 0.0, 0.7}, 40, 5); }

TEST_P(MarchingCubes, EqualsTheSlowMesherOnSmoothSurfaces) {
  VolumeGrid grid(0.02, 1e-5);
  testing::fill(grid, -11, 14, [](const Vec3& p) { return (p - Vec3(0.03, 0.013, 0.021)).norm() - 0.17; });
  Rng rng(9);
  testing::for_each_voxel(-8, 8, [&](testing::Lattice at) {
    if (rng.below(3) == 0) testing::set_color(grid, at, ColorVoxel{rng.next_u32()});
  });
  const ReferenceMesher reference(grid, 1);
  for (const VolumeKey key : grid.sorted_keys()) {
    const VolumeMesh mesh = mesh_volume(grid, *grid.find(key), 1);
    expect_equal(mesh, reference.mesh(key), mesh.has_colors());
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, MarchingCubes, ::testing::ValuesIn(hwy::SupportedAndGeneratedTargets()),
                         [](const auto& target) { return std::string(hwy::TargetName(target.param)); });

TEST(VolumeMesh, PacksTightly) {
  VolumeGrid grid(0.02, 1e-5);
  testing::fill(grid, -1, 10, [](const Vec3& p) { return p.z() - 0.081; });
  testing::set_color(grid, {0, 0, 4}, ColorVoxel::make(1, 2, 3, 4));
  const VolumeMesh mesh = mesh_volume(grid, *grid.find({0, 0, 0}), 1);
  EXPECT_EQ(mesh.vertex_count(), 81U);
  EXPECT_EQ(mesh.triangle_count(), 128U);
  EXPECT_EQ(mesh.bytes(), sizeof(VolumeMesh) + 81 * 7 + 64 + 64);
  EXPECT_EQ(mesh.touched_sides(), 0x0f);  // the sheet spans x and y and stays away from both z sides
}

TEST(VolumeMesh, NoSurfaceTakesNoMemory) {
  VolumeGrid grid(0.02, 1e-5);
  testing::fill(grid, 0, 8, [](const Vec3&) { return 0.05; });
  const VolumeMesh mesh = mesh_volume(grid, *grid.find({0, 0, 0}), 1);
  EXPECT_TRUE(mesh.empty());
  EXPECT_EQ(mesh.bytes(), sizeof(VolumeMesh));
  EXPECT_EQ(unpack(mesh, 0.02).vertices.size(), 0U);
}

TEST(VolumeMesh, NormalCodesDecodeToWhatWasEncoded) {
  // Every code that an encoder can make decodes to a unit vector with that octahedral code.
  for (int u = -127; u <= 127; ++u)
    for (int v = -127; v <= 127; ++v) {
      const Eigen::Vector3f n = unpack_normal(static_cast<std::uint16_t>((u & 0xff) | (v & 0xff) << 8));
      ASSERT_NEAR(n.norm(), 1.0F, 1e-5F);
      const float scale = 127.0F / n.lpNorm<1>();
      float x = n.x() * scale, y = n.y() * scale;
      if (std::abs(u) + std::abs(v) > 127) {
        const float folded = std::copysign(127.0F - std::abs(y), static_cast<float>(u));
        y = std::copysign(127.0F - std::abs(x), static_cast<float>(v));
        x = folded;
        ASSERT_LE(n.z(), 0.0F);
      }
      ASSERT_NEAR(x, static_cast<float>(u), 1e-3F) << u << ' ' << v;
      ASSERT_NEAR(y, static_cast<float>(v), 1e-3F) << u << ' ' << v;
    }
}

TEST(MinVoxelWeight, RoundsUpAndIsAtLeastOne) {
  MeshParams params;
  EXPECT_EQ(min_voxel_weight(params), 1);
  params.min_weight_ratio = 1.001;
  EXPECT_EQ(min_voxel_weight(params), 257);
  params.min_weight_ratio = 255;
  EXPECT_EQ(min_voxel_weight(params), 255 * 256);
}

}  // namespace
}  // namespace hm
