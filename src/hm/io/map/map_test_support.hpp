#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/io/map/map_file.hpp"

namespace hm::test {

struct Block {
  std::vector<std::uint32_t> voxels, colors;
  bool operator==(const Block&) const = default;
};
using Blocks = std::map<MapBlockKey, Block>;

inline MapHeader example_header() {
  MapHeader header;
  header.voxel_size_m = 0.02;
  header.sdf_unit_m = 1.25e-5;
  header.program_version = "0.1.0";
  header.parameters_toml = "[tsdf]\nvoxel_size_m = 0.02\n";
  header.state_json = R"({"next_frame": 0})";
  return header;
}

/// Half of the voxels are smooth, half are noise; every third block has no colours.
inline Block make_block(Rng& rng) {
  Block block;
  const std::uint32_t base = rng.next_u32();
  for (std::uint32_t i = 0; i < kMapBlockVoxels; ++i)
    block.voxels.push_back(i % 2 == 0 ? base + i * 37 : rng.next_u32());
  if (rng.below(3) != 0)
    for (std::uint32_t i = 0; i < kMapBlockVoxels; ++i) block.colors.push_back(rng.next_u32() & 0x0f3f3f3fu);
  return block;
}

inline Blocks make_blocks(int count, int reach, std::uint64_t seed) {
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

inline std::vector<MapBlockView> views_of(const Blocks& blocks) {
  std::vector<MapBlockView> views;
  for (const auto& [key, block] : blocks) views.push_back({key, block.voxels, block.colors});
  return views;
}

inline Result<Blocks> read_all(const MapFile& map, const std::optional<MapKeyBox>& box = {}) {
  Blocks blocks;
  const auto report = map.for_each_block(box, [&](const MapBlockView& view) {
    Block block{{view.voxels.begin(), view.voxels.end()}, {view.colors.begin(), view.colors.end()}};
    EXPECT_TRUE(blocks.emplace(view.key, std::move(block)).second);
    return true;
  });
  if (!report) return forward_error(report);
  return blocks;
}

/// Creates a map with these blocks and closes it.
inline void save(const std::filesystem::path& path, const Blocks& blocks, const std::string& state = "{}") {
  auto map = MapFile::create(path, example_header());
  ASSERT_TRUE(map) << to_string(map.error());
  const auto put = map->put_blocks(views_of(blocks));
  ASSERT_TRUE(put) << to_string(put.error());
  const auto committed = map->commit(state);
  ASSERT_TRUE(committed) << to_string(committed.error());
}

inline MapFile open_map(const std::filesystem::path& path, MapOpenMode mode = MapOpenMode::kRead) {
  auto map = MapFile::open(path, mode);
  EXPECT_TRUE(map) << to_string(map.error());
  return std::move(map.value());
}

}  // namespace hm::test
