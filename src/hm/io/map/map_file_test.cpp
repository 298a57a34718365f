#include "hm/io/map/map_file.hpp"

#include <gmock/gmock.h>

#include "hm/core/rng.hpp"
#include "hm/io/map/map_test_support.hpp"
#include "hm/io/testing/io_test_support.hpp"

namespace hm {
namespace {

using test::Blocks;
using test::example_header;
using test::make_block;
using test::make_blocks;
using test::open_map;
using test::read_all;
using test::save;
using test::views_of;
using testing::HasSubstr;

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

}  // namespace
}  // namespace hm
