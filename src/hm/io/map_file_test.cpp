#include "hm/io/map_file.hpp"

#include <gmock/gmock.h>
#include <sys/wait.h>

#include <algorithm>
#include <csignal>
#include <map>
#include <optional>

#include "hm/core/rng.hpp"
#include "hm/io/io_test_support.hpp"

namespace hm {
namespace {

using test::TemporaryFolder;
using testing::HasSubstr;

struct Block {
  std::vector<std::uint32_t> voxels, colors;
  bool operator==(const Block&) const = default;
};
using Blocks = std::map<MapBlockKey, Block>;

MapHeader example_header() {
  MapHeader header;
  header.voxel_size_m = 0.02;
  header.sdf_unit_m = 1.25e-5;
  header.program_version = "0.1.0";
  header.parameters_toml = "[tsdf]\nvoxel_size_m = 0.02\n";
  header.state_json = R"({"next_frame": 0})";
  return header;
}

/// Half of the voxels are smooth, half are noise; every third block has no colours.
Block make_block(Rng& rng) {
  Block block;
  const std::uint32_t base = rng.next_u32();
  for (std::uint32_t i = 0; i < kMapBlockVoxels; ++i)
    block.voxels.push_back(i % 2 == 0 ? base + i * 37 : rng.next_u32());
  if (rng.below(3) != 0)
    for (std::uint32_t i = 0; i < kMapBlockVoxels; ++i) block.colors.push_back(rng.next_u32() & 0x0f3f3f3fu);
  return block;
}

Blocks make_blocks(int count, int reach, std::uint64_t seed) {
  Rng rng(seed);
  const auto coordinate = [&] {
    return static_cast<std::int32_t>(rng.below(static_cast<std::uint32_t>(2 * reach))) - reach;
  };
  Blocks blocks;
  for (int i = 0; i < count; ++i) {
    const MapBlockKey key{coordinate(), coordinate(), coordinate()};
    blocks[key] = make_block(rng);
  }
  return blocks;
}

std::vector<MapBlockView> views_of(const Blocks& blocks) {
  std::vector<MapBlockView> views;
  for (const auto& [key, block] : blocks) views.push_back({key, block.voxels, block.colors});
  return views;
}

Result<Blocks> read_all(const MapFile& map, const std::optional<MapKeyBox>& box = {}) {
  Blocks blocks;
  const auto report = map.for_each_block(box, [&](const MapBlockView& view) {
    Block block{{view.voxels.begin(), view.voxels.end()}, {view.colors.begin(), view.colors.end()}};
    EXPECT_TRUE(blocks.emplace(view.key, std::move(block)).second);
    return true;
  });
  if (!report) return forward_error(report);
  return blocks;
}

/// Makes a map with these blocks and closes it.
void save(const std::filesystem::path& path, const Blocks& blocks, const std::string& state = "{}") {
  auto map = MapFile::create(path, example_header());
  ASSERT_TRUE(map) << to_string(map.error());
  const auto put = map->put_blocks(views_of(blocks));
  ASSERT_TRUE(put) << to_string(put.error());
  const auto committed = map->commit(state);
  ASSERT_TRUE(committed) << to_string(committed.error());
}

MapFile open_map(const std::filesystem::path& path, MapOpenMode mode = MapOpenMode::kRead) {
  auto map = MapFile::open(path, mode);
  EXPECT_TRUE(map) << to_string(map.error());
  return std::move(map.value());
}

TEST(MapFile, RoundTripKeepsEveryBitAndLeavesOneFile) {
  const TemporaryFolder folder;
  Blocks blocks = make_blocks(300, 9, 1);
  Rng rng(2);
  blocks[{0x7fffffff, -0x7fffffff - 1, 0}] = make_block(rng);  // the corners of the key space
  blocks[{-1, -1, -1}] = make_block(rng);
  save(folder / "a.hmap", blocks, R"({"next_frame": 17})");
  EXPECT_EQ(folder.file_count(), 1u);

  const MapFile map = open_map(folder / "a.hmap");
  EXPECT_EQ(map.header().voxel_size_m, 0.02);
  EXPECT_EQ(map.header().sdf_unit_m, 1.25e-5);
  EXPECT_EQ(map.header().program_version, "0.1.0");
  EXPECT_EQ(map.header().parameters_toml, example_header().parameters_toml);
  EXPECT_EQ(map.header().state_json, R"({"next_frame": 17})");
  EXPECT_EQ(map.header().format_version, kMapFormatVersion);
  EXPECT_GT(map.header().created_unix_ms, 0);
  EXPECT_GE(map.header().updated_unix_ms, map.header().created_unix_ms);
  EXPECT_EQ(map.block_count(), blocks.size());
  EXPECT_EQ(map.file_bytes(), std::filesystem::file_size(folder / "a.hmap"));
  ASSERT_TRUE(map.key_bounds());
  EXPECT_EQ(map.key_bounds()->max[0], 0x7fffffff);
  EXPECT_EQ(map.key_bounds()->min[1], -0x7fffffff - 1);
  const auto read = read_all(map);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(*read, blocks);
}

TEST(MapFile, AnEmptyMapIsAMap) {
  const TemporaryFolder folder;
  save(folder / "a.hmap", {});
  const MapFile map = open_map(folder / "a.hmap");
  EXPECT_EQ(map.block_count(), 0u);
  EXPECT_FALSE(map.key_bounds());
  EXPECT_TRUE(read_all(map)->empty());
}

TEST(MapFile, ReadsARegionLikeAFilter) {
  const TemporaryFolder folder;
  const Blocks blocks = make_blocks(500, 10, 3);
  save(folder / "a.hmap", blocks);
  const MapFile map = open_map(folder / "a.hmap");
  Rng rng(4);
  for (int trial = 0; trial < 50; ++trial) {
    MapKeyBox box;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.min[axis] = static_cast<std::int32_t>(rng.below(24)) - 12;
      box.max[axis] = box.min[axis] + static_cast<std::int32_t>(rng.below(12)) - 1;
    }
    Blocks expected;
    for (const auto& [key, block] : blocks) {
      bool in = true;
      for (std::size_t axis = 0; axis < 3; ++axis)
        in &= key[axis] >= box.min[axis] && key[axis] <= box.max[axis];
      if (in) expected[key] = block;
    }
    const auto read = read_all(map, box);
    ASSERT_TRUE(read);
    EXPECT_EQ(*read, expected);
  }
}

TEST(MapFile, StopsWhenAsked) {
  const TemporaryFolder folder;
  save(folder / "a.hmap", make_blocks(50, 3, 5));
  int seen = 0;
  const auto report =
      open_map(folder / "a.hmap").for_each_block({}, [&](const MapBlockView&) { return ++seen < 7; });
  ASSERT_TRUE(report);
  EXPECT_FALSE(report->complete);
  EXPECT_EQ(seen, 7);
}

TEST(MapFile, RandomEditsFollowAReference) {
  const TemporaryFolder folder;
  Blocks expected = make_blocks(100, 5, 6);
  save(folder / "a.hmap", expected);
  Rng rng(7);
  for (int round = 0; round < 15; ++round) {
    MapFile map = open_map(folder / "a.hmap", MapOpenMode::kReadWrite);
    const Blocks fresh =
        make_blocks(static_cast<int>(rng.below(60)), 5, 100 + static_cast<std::uint64_t>(round));
    std::vector<MapBlockKey> doomed;
    for (const auto& [key, block] : expected)
      if (rng.below(4) == 0) doomed.push_back(key);
    doomed.push_back({1000, 1000, 1000});  // not there
    Blocks next = expected;
    if (round == 9) {
      ASSERT_TRUE(map.clear());
      next.clear();
    }
    for (const MapBlockKey& key : doomed) next.erase(key);
    for (const auto& [key, block] : fresh) next[key] = block;
    ASSERT_TRUE(map.erase(doomed));
    ASSERT_TRUE(map.put_blocks(views_of(fresh)));
    EXPECT_EQ(*read_all(map), next);  // changes can be read before they are committed
    if (round % 3 == 2) continue;     // closed without commit: dropped
    ASSERT_TRUE(map.commit("{}"));
    expected = next;
  }
  EXPECT_EQ(*read_all(open_map(folder / "a.hmap")), expected);
  EXPECT_EQ(folder.file_count(), 1u);
}

TEST(MapFile, CreateReplacesAndOtherProgramsKeepTheirFiles) {
  const TemporaryFolder folder;
  save(folder / "a.hmap", make_blocks(30, 3, 8));
  const Blocks blocks = make_blocks(10, 3, 9);
  save(folder / "a.hmap", blocks);
  EXPECT_EQ(*read_all(open_map(folder / "a.hmap")), blocks);
  const auto nowhere = MapFile::create(folder / "no/such/folder.hmap", example_header());
  ASSERT_FALSE(nowhere);
  EXPECT_THAT(to_string(nowhere.error()), HasSubstr("folder.hmap"));
  MapHeader header = example_header();
  header.voxel_size_m = 0;
  EXPECT_FALSE(MapFile::create(folder / "b.hmap", header));
}

TEST(MapFile, SaysWhatIsWrongWithAFile) {
  const TemporaryFolder folder;
  EXPECT_EQ(MapFile::open(folder / "none.hmap", MapOpenMode::kRead).error().code, ErrorCode::kNotFound);
  test::write_bytes(folder / "empty.hmap", "");
  EXPECT_EQ(MapFile::open(folder / "empty.hmap", MapOpenMode::kRead).error().code, ErrorCode::kTruncated);
  test::write_bytes(folder / "text.hmap", std::string(5000, 'x'));
  EXPECT_THAT(MapFile::open(folder / "text.hmap", MapOpenMode::kRead).error().message,
              HasSubstr("not a housemartin map"));
  EXPECT_FALSE(MapFile::open(folder / "", MapOpenMode::kRead));

  save(folder / "a.hmap", make_blocks(100, 4, 10));
  const std::string bytes = test::read_bytes(folder / "a.hmap");
  test::write_bytes(folder / "half.hmap", bytes.substr(0, bytes.size() / 2));
  const auto half = MapFile::open(folder / "half.hmap", MapOpenMode::kRead);
  ASSERT_FALSE(half);
  EXPECT_THAT(to_string(half.error()), HasSubstr("half.hmap"));
  EXPECT_THAT(half.error().message, HasSubstr("truncated"));

  std::string newer = bytes;
  newer[63] = 9;  // user_version, big endian at 60
  test::write_bytes(folder / "newer.hmap", newer);
  const auto version = MapFile::open(folder / "newer.hmap", MapOpenMode::kRead);
  ASSERT_FALSE(version);
  EXPECT_EQ(version.error().code, ErrorCode::kUnsupported);
  EXPECT_THAT(version.error().message, HasSubstr("version 9"));
}

/// Opens a damaged map every way; what it gives must be an Error or blocks exactly as they were.
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

TEST(MapFile, DamageIsAnErrorOrHarmlessNeverWrongData) {
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
  EXPECT_GE(cases, 1400);
  EXPECT_LT(successes, cases / 2);  // most damage is noticed: little of the file is padding
}

TEST(MapFile, LenientReadingSavesTheRest) {
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

// ---- killed while saving ----

/// What every block holds after save number `generation`; odd generations lack the blocks with odd x.
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

/// Saves generation after generation until it is killed; tells each that commit() called done.
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

TEST(MapFile, SurvivesKillAtAnyMoment) {
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
    ::usleep(2000 + rng.below(40000));
    ::kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status)) << "the child gave up with status " << WEXITSTATUS(status);
    int promised = last;
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
