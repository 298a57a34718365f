#include <gtest/gtest.h>

#include <cstring>

#include "hm/core/hash.hpp"
#include "hm/mvog/dense_reference_test_support.hpp"
#include "hm/mvog/multi_volume_grid.hpp"

namespace hm {
namespace {

MultiVolumeGrid some_grid(int scans) {
  MultiVolumeGrid grid;
  Rng rng(31);
  for (int i = 0; i < scans; ++i) grid.insert(test::random_scan(rng, 50, 2, {-0.5 * i, 0.3, -4}).view());
  return grid;
}

TEST(GridBytes, ComeBackAsTheyWere) {
  const MultiVolumeGrid grid = some_grid(8);
  const auto bytes = grid.serialise();
  auto back = MultiVolumeGrid::parse(bytes);
  ASSERT_TRUE(back.has_value()) << to_string(back.error());
  EXPECT_EQ(back->serialise(), bytes);
  EXPECT_EQ(back->revision(), grid.revision());
  EXPECT_EQ(back->changed_since(3).size(), grid.changed_since(3).size());
  // It goes on as if nothing had been.
  MultiVolumeGrid original = some_grid(8);
  Rng rng(5);
  const auto scan = test::random_scan(rng, 100, 2, {0, 0, -4});
  original.insert(scan.view());
  back->insert(scan.view());
  EXPECT_EQ(back->serialise(), original.serialise());
}

TEST(GridBytes, EmptyMapsToo) {
  const auto back = MultiVolumeGrid::parse(MultiVolumeGrid().serialise());
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(back->size().columns, 0u);
}

TEST(GridBytes, EveryPrefixAndEveryDamageIsAnErrorWithItsPlace) {
  const auto bytes = some_grid(2).serialise();
  for (std::size_t length = 0; length < bytes.size(); length += length < 300 ? 1 : 37) {
    const auto parsed = MultiVolumeGrid::parse(std::span(bytes).first(length));
    ASSERT_FALSE(parsed.has_value()) << length;
    ASSERT_NE(parsed.error().where.find("byte "), std::string::npos);
  }
  Rng rng(3);
  for (int i = 0; i < 3000; ++i) {
    auto damaged = bytes;
    const std::size_t at = rng.below(static_cast<std::uint32_t>(bytes.size()));
    damaged[at] ^= static_cast<std::byte>(1 + rng.below(255));
    ASSERT_FALSE(MultiVolumeGrid::parse(damaged).has_value()) << "byte " << at;
  }
  auto longer = bytes;
  longer.push_back(std::byte{0});
  EXPECT_EQ(MultiVolumeGrid::parse(longer).error().code, ErrorCode::kCorrupted);
}

/// The checksum of the format, to plant damage behind its back.
std::uint64_t fnv(const std::byte* bytes, std::size_t count) { return fnv1a(std::span(bytes, count)); }

TEST(GridBytes, DamageWithARightChecksumNeverCrashesAndNeverGivesABadMap) {
  MultiVolumeGrid grid;
  const std::vector<Eigen::Vector3f> points{{0.45F, 0.55F, 0.3F}, {0.3F, 0.6F, 0.1F}};
  grid.insert(points, {0.12, 0.12, 0.5});  // one tile
  ASSERT_EQ(grid.size().tiles, 1u);
  const auto bytes = grid.serialise();
  constexpr std::size_t kHeader = 184;
  const std::size_t tile = kHeader + 8;
  Rng rng(17);
  int parsed = 0;
  for (int i = 0; i < 6000; ++i) {
    auto damaged = bytes;
    for (std::uint32_t k = 0; k <= rng.below(3); ++k)
      damaged[rng.below(static_cast<std::uint32_t>(bytes.size()))] = static_cast<std::byte>(rng.below(256));
    const std::uint64_t head = fnv(damaged.data(), kHeader);
    std::memcpy(&damaged[kHeader], &head, 8);
    const std::uint64_t body = fnv(&damaged[tile], damaged.size() - tile - 8);
    std::memcpy(&damaged[damaged.size() - 8], &body, 8);
    auto map = MultiVolumeGrid::parse(damaged);
    if (!map) continue;
    ++parsed;
    ASSERT_FALSE(map->voxels().empty() && map->size().columns > 0);
    ASSERT_LE(map->cast_ray({0, 0, 0.3}, {0.7, 0.7, 0.2}).distance_m, 1.0);
    map->insert(points, {0.12, 0.12, 0.5});
    ASSERT_TRUE(MultiVolumeGrid::parse(map->serialise()).has_value());
  }
  EXPECT_GT(parsed, 50);
}

TEST(GridBytes, AnotherVersionIsRefusedWithBothNumbers) {
  auto bytes = some_grid(1).serialise();
  bytes[8] = std::byte{9};
  const auto parsed = MultiVolumeGrid::parse(bytes);
  EXPECT_EQ(parsed.error().code, ErrorCode::kUnsupported);
  EXPECT_NE(parsed.error().message.find('9'), std::string::npos);
}

}  // namespace
}  // namespace hm
