#include "hm/tsdf/grid/packed_volume.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>

#include "hm/core/parallel.hpp"
#include "hm/core/rng.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {
namespace {

struct Planes {
  std::array<TsdfVoxel, kVolumeVoxels> voxels{};
  std::array<ColorVoxel, kVolumeVoxels> colors{};
  bool operator==(const Planes&) const = default;
};

/// Runs of zeros and of other values, of any length.
template <class Voxel>
void fill_with_runs(std::array<Voxel, kVolumeVoxels>& plane, Rng& rng) {
  const std::uint32_t longest = 1 + rng.below(600);
  bool zeros = rng.below(2) == 0;
  for (std::size_t i = 0; i < plane.size(); zeros = !zeros)
    for (std::uint32_t left = 1 + rng.below(longest); left > 0 && i < plane.size(); --left, ++i)
      plane[i].bits = zeros ? 0 : rng.next_u32();
}

TEST(PackedVolume, UnpacksToTheSameBits) {
  Rng rng(1);
  for (int round = 0; round < 3000; ++round) {
    Planes planes, again;
    if (round > 0) fill_with_runs(planes.voxels, rng);
    if (round % 7 > 1) fill_with_runs(planes.colors, rng);
    const bool with_colors = round % 7 > 0;
    const PackedVolume packed =
        PackedVolume::pack(planes.voxels.data(), with_colors ? planes.colors.data() : nullptr).copy();
    EXPECT_FALSE(packed.empty());
    EXPECT_EQ(packed.has_colors(), with_colors);
    for (TsdfVoxel& voxel : again.voxels) voxel.bits = 1;
    if (with_colors)
      for (ColorVoxel& color : again.colors) color.bits = 1;
    packed.unpack(again.voxels.data(), again.colors.data());
    ASSERT_EQ(planes, again) << round;
    const auto known = [](const auto& voxel) { return voxel.bits != 0; };
    const auto count = std::count_if(planes.voxels.begin(), planes.voxels.end(), known) +
                       std::count_if(planes.colors.begin(), planes.colors.end(), known);
    EXPECT_EQ(packed.bytes(), 4u * static_cast<std::size_t>(count) + (with_colors ? 128u : 64u) + 8u);
    EXPECT_EQ(packed.holds_interior(),
              std::any_of(planes.voxels.begin(), planes.voxels.end(),
                          [](TsdfVoxel voxel) { return voxel.weight() > 0 && voxel.sdf() <= 0; }));
  }
}

void fill(VolumeGrid& grid, Volume& volume, Rng& rng) {
  for (int i = 0; i < kVolumeVoxels; ++i)
    if (rng.below(3) == 0) volume.voxels[i].bits = rng.next_u32();
  if (rng.below(2) == 0 || !grid.allocate_colors(volume)) return;
  for (int i = 0; i < kVolumeVoxels; i += 3) volume.colors[i].bits = rng.next_u32();
}

void expect_equal(const VolumeGrid& a, const VolumeGrid& b) {
  ASSERT_EQ(a.sorted_keys(), b.sorted_keys());
  for (const VolumeKey key : a.sorted_keys()) {
    const Volume *va = a.find(key), *vb = b.find(key);
    ASSERT_TRUE(std::equal(va->voxels, va->voxels + kVolumeVoxels, vb->voxels));
    ASSERT_EQ(va->colors == nullptr, vb->colors == nullptr);
    ASSERT_TRUE(!va->colors || std::equal(va->colors, va->colors + kVolumeVoxels, vb->colors));
    ASSERT_EQ(a.may_hold_interior(key), b.may_hold_interior(key));
  }
}

/// Applies the same random changes to both grids, and packs one of them.
void change_both(VolumeGrid& plain, VolumeGrid& packing, Rng& rng) {
  const auto coordinate = [&] { return static_cast<int>(rng.below(24)) - 12; };
  for (int i = 0; i < 30; ++i) {
    const VolumeKey key{coordinate(), coordinate(), static_cast<int>(rng.below(8))};
    const std::uint64_t seed = rng.next_u32();
    const std::uint32_t what = rng.below(8);
    for (VolumeGrid* grid : {&plain, &packing}) {
      Rng same(seed);
      if (what == 0) {
        grid->release(key);
      } else if (what == 1 && grid->find(key)) {
        grid->release_colors(*grid->find(key));
      } else if (Volume* volume = grid->allocate(key)) {
        fill(*grid, *volume, same);
        grid->set_may_hold_interior(key, same.below(2) == 0);
      }
    }
  }
  packing.pack_idle(static_cast<int>(rng.below(40)));
}

TEST(VolumeGridPacking, ShowsNowhereButInMemory) {
  VolumeGrid plain(0.02, 1e-5, 8'000'000), packing(0.02, 1e-5, 8'000'000);
  Rng rng(2);
  for (int scan = 0; scan < 400; ++scan) {
    change_both(plain, packing, rng);
    ASSERT_EQ(plain.unpacked_bytes(), packing.unpacked_bytes()) << "the cap acts at the same moment";
    if (scan % 40 != 20) continue;
    for (int call = 0; call < 40; ++call) packing.pack_idle(0);  // idle calls
    EXPECT_LT(packing.map_bytes(), plain.map_bytes() * 3 / 4);
  }
  EXPECT_EQ(plain.map_bytes(), plain.unpacked_bytes());
  expect_equal(plain, packing);
  for (const VolumeKey key : packing.sorted_keys()) packing.pack(key);
  const std::size_t all_packed = packing.map_bytes();
  expect_equal(plain, packing);  // which unpacks
  EXPECT_LT(all_packed, packing.map_bytes());
  for (const VolumeKey key : packing.sorted_keys()) packing.release(key);
  for (const VolumeKey key : plain.sorted_keys()) plain.release(key);
  EXPECT_EQ(plain.map_bytes(), packing.map_bytes());
}

TEST(VolumeGridPacking, ManyThreadsMayReadPackedVolumes) {
  VolumeGrid grid(0.02, 1e-5), plain(0.02, 1e-5);
  Rng rng(3);
  for (int scan = 0; scan < 60; ++scan) change_both(plain, grid, rng);
  const auto keys = grid.sorted_keys();
  const ParallelLoop loop(4);
  for (int round = 0; round < 5; ++round) {
    for (const VolumeKey key : keys) grid.pack(key);
    std::vector<std::uint32_t> sums(8 * keys.size());
    const VolumeGrid& shared = grid;
    loop.for_ranges(sums.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Volume* volume = shared.find(keys[i % keys.size()]);
        for (int v = 0; v < kVolumeVoxels; ++v) sums[i] += volume->voxels[v].bits;
        for (int v = 0; volume->colors && v < kVolumeVoxels; ++v) sums[i] += volume->colors[v].bits;
      }
    });
    for (std::size_t i = keys.size(); i < sums.size(); ++i) ASSERT_EQ(sums[i], sums[i - keys.size()]);
    expect_equal(plain, grid);
  }
}

VolumesByPage all_of(const VolumeGrid& grid) {
  VolumesByPage all;
  for (const VolumeKey key : grid.sorted_keys()) all[page_of(key)] |= place_bit(key);
  return all;
}

TEST(VolumeGridSnapshot, IsTheGridOfItsFirstMoment) {
  Rng rng(4);
  for (int round = 0; round < 20; ++round) {
    VolumeGrid then(0.02, 1e-5), grid(0.02, 1e-5), unused(0.02, 1e-5);
    for (int scan = 0; scan < 20; ++scan) change_both(then, grid, rng);
    VolumesByPage wanted = all_of(grid);
    const VolumeKey missing{100, 100, 100};
    wanted[page_of(missing)] |= place_bit(missing);
    grid.begin_snapshot(wanted);
    EXPECT_TRUE(grid.snapshot_under_way());
    VolumeGrid restored(0.02, 1e-5);
    std::size_t asked_for = 0;
    while (grid.snapshot_under_way()) {
      change_both(unused, grid, rng);
      for (const PageSnapshot& page : grid.take_snapshot(1 + rng.below(100))) {
        asked_for += static_cast<std::size_t>(std::popcount(page.wanted));
        for (const VolumeSnapshot& kept : page.volumes) {
          ASSERT_TRUE(page.wanted & place_bit(kept.key));
          ASSERT_FALSE(restored.contains(kept.key)) << "given twice";
          Volume* volume = restored.allocate(kept.key);
          if (kept.contents.has_colors()) restored.allocate_colors(*volume);
          kept.contents.unpack(volume->voxels, volume->colors);
          restored.set_may_hold_interior(kept.key, kept.may_hold_interior);
        }
      }
    }
    EXPECT_EQ(asked_for, then.volume_count() + 1);
    EXPECT_TRUE(grid.take_snapshot(10).empty());
    expect_equal(then, restored);
  }
}

}  // namespace
}  // namespace hm
