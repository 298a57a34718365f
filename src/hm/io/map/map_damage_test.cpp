#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>

#include "hm/core/rng.hpp"
#include "hm/core/testing/sanitized.hpp"
#include "hm/io/map/map_file.hpp"
#include "hm/io/map/map_test_support.hpp"
#include "hm/io/testing/io_test_support.hpp"

namespace hm {
namespace {

using test::Block;
using test::Blocks;
using test::make_blocks;
using test::open_map;
using test::read_all;
using test::save;
using test::views_of;
using testing::HasSubstr;

/// Opens a damaged map in all modes; the result must be an Error or the original blocks.
void expect_error_or_truth(const std::filesystem::path& path, const Blocks& truth, const std::string& state,
                           int& strict_successes) {
  for (const MapOpenMode mode : {MapOpenMode::kRead, MapOpenMode::kReadLenient}) {
    const auto map = MapFile::open(path, mode);
    if (!map) {
      EXPECT_THAT(to_string(map.error()), HasSubstr(path.string()));
      continue;
    }
    EXPECT_EQ(map->header().state_json, state);
    EXPECT_EQ(map->header().voxel_size_m, 0.02);
    Blocks blocks;
    const auto report = map->for_each_block({}, [&](const MapBlockView& view) {
      blocks[view.key] = {{view.voxels.begin(), view.voxels.end()}, {view.colors.begin(), view.colors.end()}};
      return true;
    });
    if (mode == MapOpenMode::kRead) {
      if (!report) {
        EXPECT_THAT(to_string(report.error()), HasSubstr(path.string()));
        continue;
      }
      ++strict_successes;
      EXPECT_EQ(blocks, truth);
      continue;
    }
    ASSERT_TRUE(report) << to_string(report.error());
    EXPECT_EQ(report->blocks_read + report->blocks_skipped, truth.size());
    EXPECT_EQ(report->blocks_read, blocks.size());
    EXPECT_TRUE(report->blocks_skipped == 0 || !report->problems.empty());
    for (const auto& [key, block] : blocks) {
      const auto place = truth.find(key);
      EXPECT_TRUE(place != truth.end() && place->second == block);
    }
  }
}

TEST(MapDamage, DamageIsAnErrorOrHarmlessNeverWrongData) {
  const TemporaryFolder folder;
  const Blocks blocks = make_blocks(40, 4, 11);
  save(folder / "a.hmap", blocks, "state");
  const std::string bytes = test::read_bytes(folder / "a.hmap");
  int successes = 0, cases = 0;
  test::for_each_damaged(bytes, 700, [&](const std::string& damaged) {
    ++cases;
    test::write_bytes(folder / "b.hmap", damaged);
    expect_error_or_truth(folder / "b.hmap", blocks, "state", successes);
    if (cases % 16 != 0) return;
    // A writer must survive it, too.
    auto map = MapFile::open(folder / "b.hmap", MapOpenMode::kReadWrite);
    if (map && map->put_blocks(views_of(blocks))) (void)map->commit("again");
  });
  EXPECT_GE(cases, test::repetitions(1400, 460));
  EXPECT_LT(successes, cases / 2);  // most damage is noticed: little of the file is padding
}

TEST(MapDamage, LenientReadingSavesTheRest) {
  const TemporaryFolder folder;
  const Blocks blocks = make_blocks(2000, 12, 12);
  save(folder / "a.hmap", blocks);
  std::string bytes = test::read_bytes(folder / "a.hmap");
  const std::size_t middle = bytes.size() / 2;
  for (std::size_t i = middle; i < middle + 3000; ++i) bytes[i] = static_cast<char>(bytes[i] ^ 0x5a);
  test::write_bytes(folder / "b.hmap", bytes);

  const auto strict = MapFile::open(folder / "b.hmap", MapOpenMode::kRead);
  if (strict) {
    const auto read = read_all(*strict);
    ASSERT_FALSE(read);
    EXPECT_THAT(read.error().message, HasSubstr("page of blocks ("));
  }
  const MapFile map = open_map(folder / "b.hmap", MapOpenMode::kReadLenient);
  const auto report = map.for_each_block({}, [&](const MapBlockView& view) {
    const Block& truth = blocks.at(view.key);
    EXPECT_TRUE(std::ranges::equal(view.voxels, truth.voxels) &&
                std::ranges::equal(view.colors, truth.colors));
    return true;
  });
  ASSERT_TRUE(report);
  EXPECT_GT(report->blocks_skipped, 0u);
  EXPECT_LT(report->blocks_skipped, blocks.size() / 10);
  EXPECT_EQ(report->blocks_read + report->blocks_skipped, blocks.size());
  EXPECT_FALSE(report->problems.empty());

  test::write_bytes(folder / "c.hmap", test::read_bytes(folder / "a.hmap").substr(0, bytes.size() * 3 / 4));
  const auto cut = MapFile::open(folder / "c.hmap", MapOpenMode::kReadLenient);
  ASSERT_TRUE(cut) << to_string(cut.error());
  const auto rest = cut->for_each_block({}, [](const MapBlockView&) { return true; });
  ASSERT_TRUE(rest);
  EXPECT_GT(rest->blocks_read, blocks.size() / 2);
  EXPECT_GT(rest->blocks_skipped, 0u);
}

TEST(MapDamage, AFullDiskKeepsTheLastSave) {
  const TemporaryFolder folder;
  const auto path = folder / "a.hmap";
  const Blocks old = make_blocks(20, 3, 14), fresh = make_blocks(3000, 20, 15);
  save(path, old, "old");
  const pid_t child = ::fork();
  if (child == 0) {
    MapFile map = open_map(path, MapOpenMode::kReadWrite);
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{2'000'000, 2'000'000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    const auto put = map.put_blocks(views_of(fresh));
    const bool failed = !put || !map.commit("fresh");
    const auto read = read_all(map);  // memory follows the file
    ::_exit(failed && read && *read == old && map.header().state_json == "old" ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_EQ(*read_all(open_map(path)), old);
}

// ---- killed while saving ----

/// Contents of every block after save number `generation`; odd generations lack the blocks with odd x.
Blocks blocks_of_generation(int generation) {
  Blocks blocks;
  for (std::int32_t x = 0; x < 6; ++x)
    for (std::int32_t y = 0; y < 6; ++y)
      for (std::int32_t z = 0; z < 4; ++z) {
        if (generation % 2 == 1 && x % 2 == 1) continue;
        Rng rng(static_cast<std::uint64_t>(generation), static_cast<std::uint64_t>(x * 100 + y * 10 + z));
        Block& block = blocks[{x, y, z}];
        for (std::size_t i = 0; i < kMapBlockVoxels; ++i) block.voxels.push_back(rng.next_u32());
      }
  return blocks;
}

/// Saves generation after generation until it is killed; reports each committed one.
[[noreturn]] void save_until_killed(const std::filesystem::path& path, int pipe_end) {
  auto map = MapFile::open(path, MapOpenMode::kReadWrite);
  if (!map) ::_exit(1);
  for (int generation = std::stoi(map->header().state_json) + 1;; ++generation) {
    std::vector<MapBlockKey> doomed;
    for (const auto& [key, block] : blocks_of_generation(generation - 1)) doomed.push_back(key);
    const Blocks blocks = blocks_of_generation(generation);
    if (generation % 3 != 0 && !map->erase(doomed)) ::_exit(2);
    if (generation % 3 == 0 && !map->clear()) ::_exit(3);
    if (!map->put_blocks(views_of(blocks)) || !map->commit(std::to_string(generation))) ::_exit(4);
    if (::write(pipe_end, &generation, sizeof generation) != sizeof generation) ::_exit(5);
  }
}

TEST(MapDamage, SurvivesKillAtAnyMoment) {
  const TemporaryFolder folder;
  const auto path = folder / "a.hmap";
  save(path, blocks_of_generation(0), "0");
  Rng rng(13);
  int interrupted = 0, last = 0;
  for (int trial = 0; trial < 60; ++trial) {
    std::array<int, 2> ends{};
    ASSERT_EQ(::pipe(ends.data()), 0);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) save_until_killed(path, ends[1]);
    ::close(ends[1]);
    // The clock starts with the first save, so that slow machines are hit while saving, too.
    int promised = last;
    ASSERT_EQ(::read(ends[0], &promised, sizeof promised), ssize_t{sizeof promised});
    ::usleep(rng.below(40000));
    ::kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status)) << "the child gave up with status " << WEXITSTATUS(status);
    while (::read(ends[0], &promised, sizeof promised) == sizeof promised) {
    }
    ::close(ends[0]);
    interrupted += std::filesystem::exists(path.string() + "-journal") ? 1 : 0;

    const MapFile map = open_map(path, trial % 2 == 0 ? MapOpenMode::kReadWrite : MapOpenMode::kRead);
    const int generation = std::stoi(map.header().state_json);
    EXPECT_GE(generation, promised);
    EXPECT_LE(generation, promised + 1);
    const auto read = read_all(map);
    ASSERT_TRUE(read) << to_string(read.error());
    EXPECT_EQ(*read, blocks_of_generation(generation)) << "generation " << generation;
    last = generation;
  }
  EXPECT_GT(last, 5);
  EXPECT_GT(interrupted, 5) << "the kills should have hit saves";
  // A journal that holds nothing yet may lie there still; the next save clears it away.
  ASSERT_TRUE(open_map(path, MapOpenMode::kReadWrite).commit("0"));
  EXPECT_EQ(folder.file_count(), 1u);
}

}  // namespace
}  // namespace hm
