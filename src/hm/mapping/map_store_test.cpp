#include "hm/mapping/map_store.hpp"
#include "hm/mapping/map_copy.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <set>

#include "hm/core/rng.hpp"
#include "hm/core/testing/memory_limit.hpp"

namespace hm {
namespace {

std::filesystem::path temporary_map(const char* name) {
  return std::filesystem::path(testing::TempDir()) / fmt::format("hm_{}_{}.hmap", name, getpid());
}

MapHeader header_for(const VolumeGrid& grid) {
  MapHeader header;
  header.voxel_size_m = grid.voxel_size_m();
  header.sdf_unit_m = grid.sdf_unit_m();
  return header;
}

void fill(Volume& volume, Rng& rng) {
  for (int i = 0; i < kVolumeVoxels; ++i) {
    if (rng.below(3) == 0) continue;
    volume.voxels[i] = TsdfVoxel::make(static_cast<std::int16_t>(static_cast<int>(rng.below(65536)) - 32768),
                                       static_cast<std::uint16_t>(1 + rng.below(65535)));
    if (volume.colors) volume.colors[i].bits = rng.next_u32();
  }
}

void expect_equal(const VolumeGrid& a, const VolumeGrid& b) {
  ASSERT_EQ(a.sorted_keys(), b.sorted_keys());
  for (const VolumeKey& key : a.sorted_keys()) {
    const Volume *va = a.find(key), *vb = b.find(key);
    EXPECT_TRUE(std::equal(va->voxels, va->voxels + kVolumeVoxels, vb->voxels));
    ASSERT_EQ(va->colors == nullptr, vb->colors == nullptr);
    EXPECT_TRUE(!va->colors || std::equal(va->colors, va->colors + kVolumeVoxels, vb->colors));
    EXPECT_EQ(a.may_hold_interior(key), b.may_hold_interior(key));
  }
}

/// Randomly changes a grid: new volumes, new voxels, colour planes, marks, releases.
std::vector<ChangedVolume> change(VolumeGrid& grid, Rng& rng) {
  std::vector<ChangedVolume> changed;
  for (int i = 0; i < 40; ++i) {
    const auto coordinate = [&] { return static_cast<std::int32_t>(rng.below(7)) - 3; };
    const VolumeKey key{coordinate(), coordinate(), coordinate()};
    if (rng.below(5) == 0) {
      grid.release(key);
    } else {
      Volume& volume = *grid.allocate(key);
      if (rng.below(2) == 0) grid.allocate_colors(volume);
      fill(volume, rng);
      grid.set_may_hold_interior(key, rng.below(2) == 0);  // arbitrary: it must be restored
    }
    changed.push_back({key, 0x3f, false});
  }
  return changed;
}

/// Header that also returns its marks.
MapSaver::MakeHeader header_that_keeps(const VolumeGrid& grid, std::set<VolumeKey>& stored) {
  return [header = header_for(grid), &stored](const std::set<VolumeKey>& marks) {
    stored = marks;
    return header;
  };
}

/// Contents of a map, with its marks.
VolumeGrid reopened(const std::filesystem::path& path, const std::set<VolumeKey>& stored) {
  auto file = MapFile::open(path, MapOpenMode::kRead);
  EXPECT_TRUE(file);
  auto loaded = load_grid(*file);
  EXPECT_TRUE(loaded) << to_string(loaded.error());
  const std::vector<VolumeKey> marks(stored.begin(), stored.end());
  MapSaver(std::move(*file)).restore_marks(*loaded, marks);
  return std::move(*loaded);
}

TEST(MapStore, EverySaveReadsBackExactly) {
  const auto path = temporary_map("saves");
  VolumeGrid grid(0.02, 1e-5);
  auto file = MapFile::create(path, header_for(grid));
  ASSERT_TRUE(file) << to_string(file.error());
  MapSaver saver(std::move(*file));
  Rng rng(5);
  for (int round = 0; round < 8; ++round) {
    for (int scan = 0; scan < 3; ++scan) saver.note(change(grid, rng));
    std::set<VolumeKey> stored;
    const auto saved = saver.save(grid, header_that_keeps(grid, stored));
    ASSERT_TRUE(saved) << to_string(saved.error());
    EXPECT_EQ(saver.pending(), 0u);
    expect_equal(grid, reopened(path, stored));
  }
  std::filesystem::remove(path);
}

/// A copy, through the public interface only.
VolumeGrid copy_of(const VolumeGrid& grid) {
  VolumeGrid copy(grid.voxel_size_m(), grid.sdf_unit_m());
  for (const VolumeKey& key : grid.sorted_keys()) {
    const Volume* from = grid.find(key);
    Volume* to = copy.allocate(key);
    std::copy_n(from->voxels, kVolumeVoxels, to->voxels);
    if (from->colors) {
      copy.allocate_colors(*to);
      std::copy_n(from->colors, kVolumeVoxels, to->colors);
    }
    copy.set_may_hold_interior(key, grid.may_hold_interior(key));
  }
  return copy;
}

TEST(MapStore, ASaveHoldsTheMomentItBeganWhateverChangesMeanwhile) {
  const auto path = temporary_map("meanwhile");
  VolumeGrid grid(0.02, 1e-5);
  auto file = MapFile::create(path, header_for(grid));
  ASSERT_TRUE(file);
  MapSaver saver(std::move(*file));
  Rng rng(7);
  for (int round = 0; round < 12; ++round) {
    for (int scan = 0; scan < 3; ++scan) {
      saver.note(change(grid, rng));
      grid.pack_idle(0);
    }
    const VolumeGrid then = copy_of(grid);
    std::set<VolumeKey> stored;
    ASSERT_TRUE(saver.begin_save(grid, header_that_keeps(grid, stored)));
    EXPECT_TRUE(saver.saving());
    for (int scan = 0; scan < round % 4; ++scan) {
      saver.note(change(grid, rng));
      grid.pack_idle(0);
      if (round % 3 == 0) {
        ASSERT_TRUE(saver.continue_save(grid));
      }
    }
    ASSERT_TRUE(saver.finish_save(grid));
    EXPECT_FALSE(saver.saving());
    expect_equal(then, reopened(path, stored));
  }
  std::filesystem::remove(path);
}

TEST(MapStore, ASaveThatIsNotFinishedLeavesTheOneBefore) {
  const auto path = temporary_map("dropped");
  VolumeGrid grid(0.02, 1e-5);
  auto file = MapFile::create(path, header_for(grid));
  ASSERT_TRUE(file);
  Rng rng(8);
  std::set<VolumeKey> stored, unused;
  VolumeGrid then(0.02, 1e-5);
  {
    MapSaver saver(std::move(*file));
    saver.note(change(grid, rng));
    ASSERT_TRUE(saver.save(grid, header_that_keeps(grid, stored)));
    then = copy_of(grid);
    saver.note(change(grid, rng));
    ASSERT_TRUE(saver.begin_save(grid, header_that_keeps(grid, unused)));
  }
  expect_equal(then, reopened(path, stored));
  std::filesystem::remove(path);
}

TEST(MapStore, AFailedSaveIsReportedByEveryLaterCall) {
  const auto path = temporary_map("failing");
  VolumeGrid grid(0.02, 1e-5);
  auto file = MapFile::create(path, header_for(grid));
  ASSERT_TRUE(file);
  MapSaver saver(std::move(*file));
  auto blocker = MapFile::open(path, MapOpenMode::kReadWrite);
  ASSERT_TRUE(blocker);
  const std::vector<MapBlockKey> nothing;
  ASSERT_TRUE(blocker->erase(nothing));  // begins a transaction, which blocks other writers
  Rng rng(9);
  saver.note(change(grid, rng));
  EXPECT_FALSE(saver.save(grid, header_for(grid)));
  EXPECT_FALSE(grid.snapshot_under_way());
  blocker = MapFile::open(path, MapOpenMode::kRead);  // no longer blocks
  saver.note(change(grid, rng));
  EXPECT_FALSE(saver.save(grid, header_for(grid))) << "what the failed save held is missing";
  EXPECT_FALSE(saver.continue_save(grid));
  std::filesystem::remove(path);
}

TEST(MapStore, RegionLoadsTheVolumesThatTouchIt) {
  const auto path = temporary_map("region");
  VolumeGrid grid(0.02, 1e-5);
  std::vector<ChangedVolume> changed;
  Rng rng(6);
  for (int x = -5; x < 5; ++x)
    for (int y = -5; y < 5; ++y) {
      fill(*grid.allocate({x, y, 0}), rng);
      changed.push_back({{x, y, 0}, 0x3f, false});
    }
  auto file = MapFile::create(path, header_for(grid));
  ASSERT_TRUE(file);
  MapSaver saver(std::move(*file));
  saver.note(changed);
  ASSERT_TRUE(saver.save(grid, header_for(grid)));
  MapLoadOptions options;
  options.region = Box3(Vec3(-0.1, 0.05, 0.01), Vec3(0.2, 0.15, 0.02));  // volumes of 0.16 m
  const auto part = load_grid(saver.file(), options);
  ASSERT_TRUE(part);
  EXPECT_EQ(part->sorted_keys(), grid.keys_in(*options.region));
  EXPECT_EQ(part->volume_count(), 3u);
  std::filesystem::remove(path);
}

TEST(MapStore, TooLargeForTheCapIsAnError) {
  const auto path = temporary_map("cap");
  VolumeGrid grid(0.02, 1e-5);
  std::vector<ChangedVolume> changed;
  for (int x = 0; x < 200; ++x) {
    grid.allocate({x, 0, 0})->voxels[0] = TsdfVoxel::make(1, 1);
    changed.push_back({{x, 0, 0}, 0x3f, false});
  }
  auto file = MapFile::create(path, header_for(grid));
  ASSERT_TRUE(file);
  MapSaver saver(std::move(*file));
  saver.note(changed);
  ASSERT_TRUE(saver.save(grid, header_for(grid)));
  MapLoadOptions options;
  options.max_bytes = 200'000;
  const auto loaded = load_grid(saver.file(), options);
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().code, ErrorCode::kOutOfMemory);
  std::filesystem::remove(path);
}

/// Map of 40 MB with random contents, which do not pack well.
VolumeGrid large_grid(std::vector<ChangedVolume>& changed) {
  VolumeGrid grid(0.02, 1e-5);
  Rng rng(9);
  for (int x = 0; x < 20000; ++x) {
    fill(*grid.allocate({x, 0, 0}), rng);
    changed.push_back({{x, 0, 0}, 0x3f, false});
  }
  return grid;
}

TEST(MapStoreDeathTest, LoadingWithoutMemoryIsAnError) {
  if (!test::kCanLimitMemory) GTEST_SKIP();
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto path = temporary_map("no_memory");
  EXPECT_EXIT(
      {
        std::vector<ChangedVolume> changed;
        VolumeGrid grid = large_grid(changed);  // kept: occupies its memory while loading
        MapSaver saver(*MapFile::create(path, header_for(grid)));
        saver.note(changed);
        const auto saved = saver.save(grid, header_for(grid));
        test::limit_memory_to_what_is_there_and(4u << 20u);
        const auto loaded = load_grid(saver.file());
        if (!loaded) std::fputs(to_string(loaded.error()).c_str(), stderr);
        std::filesystem::remove(path);
        std::_Exit(saved && !loaded && loaded.error().code == ErrorCode::kOutOfMemory ? 0 : 1);
      },
      testing::ExitedWithCode(0), "out of memory");
}

/// The save is dropped, with an error in this and all later calls; the file is unchanged.
TEST(MapStoreDeathTest, SavingWithoutMemoryIsAnError) {
  if (!test::kCanLimitMemory) GTEST_SKIP();
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto path = temporary_map("no_memory_to_save");
  EXPECT_EXIT(
      {
        std::vector<ChangedVolume> changed;
        VolumeGrid grid = large_grid(changed);
        auto file = MapFile::create(path, header_for(grid));
        MapSaver saver(std::move(*file));
        saver.note(changed);
        test::limit_memory_to_what_is_there_and(256u << 10u);
        const auto saved = saver.save(grid, header_for(grid));
        const auto again = saver.save(grid, header_for(grid));
        if (!saved) std::fputs(to_string(saved.error()).c_str(), stderr);
        std::filesystem::remove(path);
        std::_Exit(!saved && !again && saved.error().code == ErrorCode::kOutOfMemory && !saver.saving() ? 0
                                                                                                        : 1);
      },
      testing::ExitedWithCode(0), "out of memory");
}

TEST(MapStore, GoesOnWithAFileThatWasMoved) {
  const auto path = temporary_map("before_move"), moved = temporary_map("after_move");
  VolumeGrid grid(0.02, 1e-5);
  auto file = MapFile::create(path, header_for(grid));
  ASSERT_TRUE(file);
  MapSaver saver(std::move(*file));
  Rng rng(8);
  std::set<VolumeKey> stored;
  for (int round = 0; round < 4; ++round) {
    saver.note(change(grid, rng));
    ASSERT_TRUE(saver.save(grid, header_that_keeps(grid, stored)));
    if (round != 1) continue;
    const auto done = saver.move_file(moved, [&]() -> Result<void> {
      std::filesystem::rename(path, moved);
      return {};
    });
    ASSERT_TRUE(done) << to_string(done.error());
  }
  expect_equal(grid, reopened(moved, stored));
  EXPECT_FALSE(std::filesystem::exists(path));
  std::filesystem::remove(moved);
}

TEST(MapCopy, HoldsTheMapOfTheMomentWhenItBegan) {
  const auto path = temporary_map("copy");
  VolumeGrid grid(0.02, 1e-5);
  Rng rng(9);
  for (int scan = 0; scan < 10; ++scan) change(grid, rng);
  const VolumeGrid then = copy_of(grid);
  auto copy = MapCopy::begin(grid, path, header_for(grid));
  ASSERT_TRUE(copy) << to_string(copy.error());
  for (bool complete = false; !complete;) {
    change(grid, rng);
    const auto done = copy->go_on();
    ASSERT_TRUE(done) << to_string(done.error());
    complete = *done;
  }
  const auto file = MapFile::open(path, MapOpenMode::kRead);
  ASSERT_TRUE(file);
  const auto loaded = load_grid(*file);
  ASSERT_TRUE(loaded);
  ASSERT_EQ(loaded->sorted_keys(), then.sorted_keys());
  for (const VolumeKey& key : then.sorted_keys()) {
    const Volume *ours = loaded->find(key), *wanted = then.find(key);
    EXPECT_TRUE(std::equal(wanted->voxels, wanted->voxels + kVolumeVoxels, ours->voxels));
  }
  std::filesystem::remove(path);
}

TEST(MapCopy, GivenUpItLetsTheGridGoOn) {
  const auto path = temporary_map("given_up");
  VolumeGrid grid(0.02, 1e-5);
  Rng rng(10);
  change(grid, rng);
  { ASSERT_TRUE(MapCopy::begin(grid, path, header_for(grid))); }
  EXPECT_FALSE(grid.snapshot_under_way());
  change(grid, rng);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace hm
