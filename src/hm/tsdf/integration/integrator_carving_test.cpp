#include <gtest/gtest.h>

#include <cmath>

#include "hm/core/rng.hpp"
#include "hm/tsdf/testing/integration_bench.hpp"

namespace hm {
namespace {

/// Number of voxels within `reach` of a point that lie on or behind a surface.
std::size_t solid_voxels(const VolumeGrid& grid, const Vec3& centre, double reach_m) {
  std::size_t count = 0;
  for (const VolumeKey key :
       grid.keys_in(Box3(centre - Vec3::Constant(reach_m), centre + Vec3::Constant(reach_m)))) {
    const Volume& volume = *grid.find(key);
    for (int i = 0; i < kVolumeVoxels; ++i) {
      const Vec3 index(8 * key.x + (i & 7), 8 * key.y + (i >> 3 & 7), 8 * key.z + (i >> 6));
      const Vec3 p = (index + Vec3::Constant(0.5)) * grid.voxel_size_m();
      if (volume.voxels[i].weight() > 0 && volume.voxels[i].sdf() <= 0 && (p - centre).norm() < reach_m)
        ++count;
    }
  }
  return count;
}

/// Mixed pixels widen the ball by a spurious rim; later rays that pass there remove it.
TEST(Integrator, FringesAtDepthEdgesVanish) {
  const auto beside_the_ball = [](const VolumeGrid& grid) {
    const Vec3 ball(1.2, 0, 0);
    return solid_voxels(grid, ball, 0.36) - solid_voxels(grid, ball, 0.27);
  };
  IntegrationBench bench({});
  RgbdFrame frame = kWallAndBox.render(kCamera, looking_along_x(Vec3::Zero()));
  const Image<std::uint16_t> exact = frame.depth.units;
  for (int y = 0; y < exact.height(); ++y)
    for (int x = 0; x < exact.width(); ++x)
      if (std::hypot(x - 159.5, y - 119.5) < 72 && exact(x, y) > 15000) frame.depth.units(x, y) = 12000;
  bench.integrator.integrate(bench.grid, frame);
  ASSERT_GT(beside_the_ball(bench.grid), 100u);
  for (int i = 0; i < 3; ++i) bench.add(kWallAndBox, looking_along_x(Vec3(0, 0.01 * i, 0)));
  EXPECT_EQ(beside_the_ball(bench.grid), 0u);
}

TEST(Carving, ErasesWhatHasLeftTheScene) {
  IntegrationBench bench({});
  for (int i = 0; i < 10; ++i) bench.add(kWallAndBox, looking_along_x(Vec3::Zero()));
  const Vec3 box(1.0, 0, 0);
  ASSERT_GT(solid_voxels(bench.grid, box, 0.3), 500u);
  const std::size_t volumes_before = bench.grid.volume_count();
  std::size_t carved = 0, released = 0;
  for (int i = 0; i < 10; ++i) {
    const ScanStats stats = bench.add(kWall, looking_along_x(Vec3::Zero()));
    carved += stats.voxels_carved;
    released += stats.volumes_released;
  }
  EXPECT_EQ(solid_voxels(bench.grid, box, 0.3), 0u);
  EXPECT_GT(carved, 500u);
  EXPECT_GT(released, 10u);
  EXPECT_LT(bench.grid.volume_count(), volumes_before + 20);
  // Nothing is left near the box: its volumes were released.
  EXPECT_TRUE(bench.grid.keys_in(Box3(box - Vec3::Constant(0.2), box + Vec3::Constant(0.2))).empty());
}

TEST(Carving, IsASwitch) {
  TsdfParams params;
  params.carving = false;
  IntegrationBench bench(params);
  for (int i = 0; i < 10; ++i) bench.add(kWallAndBox, looking_along_x(Vec3::Zero()));
  const std::size_t before = solid_voxels(bench.grid, Vec3(1.0, 0, 0), 0.3);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(bench.add(kWall, looking_along_x(Vec3::Zero())).voxels_carved, 0u);
  EXPECT_EQ(solid_voxels(bench.grid, Vec3(1.0, 0, 0), 0.3), before);
}

/// For any position of the pixel between the voxels (which are 2.6 pixels apart here).
TEST(Carving, OneMixedPixelDoesNotHurtTheWall) {
  constexpr std::uint16_t kBehind = 35000, kBeyondFar = 65000;
  for (const int seen_before : {1, 3, 20})
    for (const std::uint16_t mixed : {kBehind, kBeyondFar})
      for (int shift = 0; shift < 9; ++shift) {
        IntegrationBench bench({});
        for (int i = 0; i < seen_before; ++i) bench.add(kWall, looking_along_x(Vec3::Zero()));
        const std::size_t before = solid_voxels(bench.grid, Vec3(2, 0, 0), 0.2);
        RgbdFrame frame = kWall.render(kCamera, looking_along_x(Vec3::Zero()));
        frame.depth.units(160 + shift % 3, 120 + shift / 3) = mixed;
        EXPECT_EQ(bench.integrator.integrate(bench.grid, frame).voxels_carved, 0u);
        EXPECT_GE(solid_voxels(bench.grid, Vec3(2, 0, 0), 0.2), before);
      }
}

TEST(Carving, AWallThatStaysIsNotTouchedByALongRun) {
  IntegrationBench bench({});
  Rng rng(5);
  std::size_t wall = 0, ball = 0;
  for (int i = 0; i < 60; ++i) {
    RgbdFrame frame = kWallAndBox.render(kCamera, looking_along_x(Vec3(0, 0.01 * (i % 7), 0)));
    for (auto& units : frame.depth.units.pixels())
      if (units != 0) units = static_cast<std::uint16_t>(units + rng.normal(0, 60));
    bench.integrator.integrate(bench.grid, frame);
    if (i != 9) continue;
    wall = solid_voxels(bench.grid, Vec3(2, 0.8, 0), 0.2);
    ball = solid_voxels(bench.grid, Vec3(1.0, 0, 0), 0.1);
  }
  ASSERT_GT(wall, 900u);
  ASSERT_GT(ball, 150u);
  EXPECT_GE(solid_voxels(bench.grid, Vec3(2, 0.8, 0), 0.2), wall);
  EXPECT_GE(solid_voxels(bench.grid, Vec3(1.0, 0, 0), 0.1), ball);
}

}  // namespace
}  // namespace hm
