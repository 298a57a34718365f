#include "hm/tsdf/grid/volume_grid.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <tuple>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

auto order(VolumeKey k) { return std::tuple(k.z, k.y, k.x); }

TEST(VolumeGrid, RandomAllocateAndReleaseAgreeWithAMap) {
  Rng rng(7);
  VolumeGrid grid(0.02, 1e-5);
  std::map<std::tuple<int, int, int>, std::uint32_t> expected;
  const auto coordinate = [&] { return static_cast<int>(rng.below(40)) - 20; };
  for (int step = 0; step < 30000; ++step) {
    const VolumeKey key{coordinate(), coordinate() / 4, coordinate() / 4};
    if (rng.uniform() < 0.55) {
      Volume* volume = grid.allocate(key);
      ASSERT_NE(volume, nullptr);
      if (!expected.contains(order(key))) {
        for (int i = 0; i < kVolumeVoxels; ++i) ASSERT_EQ(volume->voxels[i].bits, 0u);
        volume->voxels[17].bits = static_cast<std::uint32_t>(step);
        if (step % 3 == 0) {
          ASSERT_TRUE(grid.allocate_colors(*volume));
          ASSERT_EQ(volume->colors[5].bits, 0u);
          volume->colors[5].bits = 9;
        }
        expected[order(key)] = static_cast<std::uint32_t>(step);
      }
    } else {
      grid.release(key);
      expected.erase(order(key));
    }
  }
  ASSERT_EQ(grid.volume_count(), expected.size());
  const auto keys = grid.sorted_keys();
  ASSERT_EQ(keys.size(), expected.size());
  auto next = expected.begin();
  for (const VolumeKey key : keys) {
    EXPECT_EQ(order(key), next->first);
    EXPECT_EQ(grid.find(key)->key, key);
    EXPECT_EQ(grid.find(key)->voxels[17].bits, (next++)->second);
  }
}

TEST(VolumeGrid, KeysInABoxAreThoseThatOverlapIt) {
  VolumeGrid grid(0.02, 1e-5);
  Rng rng(3);
  for (int i = 0; i < 500; ++i)
    grid.allocate({static_cast<int>(rng.below(30)) - 15, static_cast<int>(rng.below(30)) - 15,
                   static_cast<int>(rng.below(10)) - 5});
  for (const double size : {0.3, 2.0, 50.0}) {
    const Box3 box(Vec3(-0.5, -0.5, -0.5), Vec3(-0.5, -0.5, -0.5) + Vec3::Constant(size));
    std::vector<VolumeKey> expected;
    for (const VolumeKey key : grid.sorted_keys()) {
      const Vec3 low = Vec3(key.x, key.y, key.z) * 0.16;
      if (box.intersects(Box3(low, low + Vec3::Constant(0.16)))) expected.push_back(key);
    }
    EXPECT_EQ(grid.keys_in(box), expected) << size;
  }
  EXPECT_TRUE(grid.keys_in(Box3()).empty());
}

TEST(VolumeGrid, TheCapRefusesAndLosesNothing) {
  VolumeGrid grid(0.02, 1e-5, 400'000);
  int made = 0;
  while (grid.allocate({made, 0, 0}) != nullptr) ASSERT_LT(++made, 1000);
  EXPECT_GT(made, 20);
  EXPECT_LE(grid.map_bytes(), 400'000u + 16'384u);
  EXPECT_EQ(grid.volume_count(), static_cast<std::size_t>(made));
  EXPECT_NE(grid.find({made - 1, 0, 0}), nullptr);
  EXPECT_FALSE(grid.allocate_colors(*grid.find({0, 0, 0})));
  grid.release({0, 0, 0});
  grid.release({1, 0, 0});
  EXPECT_NE(grid.allocate({0, 5, 0}), nullptr);
}

TEST(VolumeGrid, KeysBeyondTheIndexAreRefused) {
  VolumeGrid grid(0.02, 1e-5);
  EXPECT_EQ(grid.allocate({1 << 23, 0, 0}), nullptr);
  EXPECT_EQ(grid.find({0, 0, -(1 << 24)}), nullptr);
}

TEST(VolumeGrid, TrilinearSampleReproducesALinearField) {
  VolumeGrid grid(0.05, 2e-5);
  const Vec3 slope(0.3, -0.5, 0.2);
  for (int z = -1; z <= 0; ++z)
    for (int y = -1; y <= 0; ++y)
      for (int x = -1; x <= 0; ++x) {
        Volume* volume = grid.allocate({x, y, z});
        for (int i = 0; i < kVolumeVoxels; ++i) {
          const Vec3 index(8 * x + (i & 7), 8 * y + (i >> 3 & 7), 8 * z + (i >> 6));
          const Vec3 centre = (index + Vec3::Constant(0.5)) * 0.05;
          volume->voxels[i] =
              TsdfVoxel::make(static_cast<std::int16_t>(std::lround(centre.dot(slope) / 2e-5)), 256);
        }
      }
  Rng rng(5);
  for (int i = 0; i < 200; ++i) {
    const Vec3 p(rng.uniform(-0.37, 0.37), rng.uniform(-0.37, 0.37), rng.uniform(-0.37, 0.37));
    const auto sample = grid.sample(p);
    ASSERT_TRUE(sample);
    EXPECT_NEAR(sample->distance_m, p.dot(slope), 2.1e-5);
    EXPECT_LT((sample->gradient - slope).norm(), 1e-3);
  }
  EXPECT_FALSE(grid.sample(Vec3(0.39, 0, 0)));
  EXPECT_FALSE(grid.distance_at_voxel(Vec3(2, 0, 0)));
}

}  // namespace
}  // namespace hm
