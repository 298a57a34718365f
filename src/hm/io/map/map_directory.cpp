#include "hm/io/map/map_directory.hpp"

#include <algorithm>
#include <bit>

namespace hm {
namespace {

constexpr std::int64_t kPageLimit = std::int64_t{1} << 29u;  ///< page keys are block keys / 4, in 32 bits

/// The finalizer of MurmurHash3 (public domain): every input bit reaches every output bit.
std::uint64_t mix(std::uint64_t x) {
  x = (x ^ x >> 33u) * 0xff51afd7ed558ccdu;
  x = (x ^ x >> 33u) * 0xc4ceb9fe1a85ec53u;
  return x ^ x >> 33u;
}

std::uint64_t digest_of(const MapPageKey& key, const MapPageEntry& entry) {
  const auto u = [](std::int32_t value) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(value));
  };
  std::uint64_t hash = mix(u(key.x) << 32u | u(key.y));
  hash = mix(hash ^ (u(key.z) << 32u | entry.checksum));
  hash = mix(hash + entry.blocks);
  return mix(hash + entry.colors);
}

/// Adds a row's page (columns z, y, x, blocks, colors, checksum, id) to the directory; false when the row is
/// invalid or the page exists already.
bool add_row(const SqliteStatement& row, MapDirectory& directory) {
  const std::int64_t z = row.integer(0), y = row.integer(1), x = row.integer(2);
  for (const std::int64_t value : {x, y, z})
    if (value < -kPageLimit || value >= kPageLimit) return false;
  MapPageEntry entry;
  entry.blocks = std::bit_cast<std::uint64_t>(row.integer(3));
  entry.colors = std::bit_cast<std::uint64_t>(row.integer(4));
  const std::int64_t checksum = row.integer(5);
  entry.checksum = static_cast<std::uint32_t>(checksum);
  entry.row = row.integer(6);
  if (entry.blocks == 0 || (entry.colors & ~entry.blocks) != 0 || checksum != std::int64_t{entry.checksum})
    return false;
  const MapPageKey key{static_cast<std::int32_t>(z), static_cast<std::int32_t>(y),
                       static_cast<std::int32_t>(x)};
  return directory.emplace(key, entry).second;
}

}  // namespace

MapDirectorySummary summarise(const MapDirectory& directory) {
  MapDirectorySummary summary;
  for (const auto& [key, entry] : directory) {
    ++summary.pages;
    summary.blocks += static_cast<std::uint64_t>(std::popcount(entry.blocks));
    summary.digest += digest_of(key, entry);
    summary.last_row = std::max(summary.last_row, entry.row);
  }
  return summary;
}

Result<MapDirectory> read_directory(SqliteDatabase& database, const std::string& where) {
  auto rows = database.prepare(
      "SELECT z, y, x, blocks, colors, checksum, id FROM pages INDEXED BY directory ORDER BY z, y, x");
  if (!rows) return forward_error(rows);
  MapDirectory directory;
  while (true) {
    const auto row = rows->step();
    if (!row) return forward_error(row);
    if (!*row) return directory;
    if (!add_row(*rows, directory))
      return fail(ErrorCode::kCorrupted, where, "the directory is damaged after {} pages", directory.size());
  }
}

MapDirectory salvage_directory(SqliteDatabase& database, std::int64_t last_row) {
  MapDirectory directory;
  auto rows =
      database.prepare("SELECT z, y, x, blocks, colors, checksum, id FROM pages NOT INDEXED WHERE id = ?");
  if (!rows) return directory;
  for (std::int64_t id = 1; id <= last_row; ++id) {
    rows->bind(0, id);
    const auto row = rows->step();
    if (row && *row) add_row(*rows, directory);
    rows->reset();
  }
  return directory;
}

std::optional<MapKeyBox> bounds(const MapDirectory& directory) {
  std::optional<MapKeyBox> box;
  for (const auto& [page, entry] : directory)
    for (std::uint64_t left = entry.blocks; left != 0; left &= left - 1) {
      const MapBlockKey key = block_key(page, std::countr_zero(left));
      if (!box) box = MapKeyBox{key, key};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        box->min[axis] = std::min(box->min[axis], key[axis]);
        box->max[axis] = std::max(box->max[axis], key[axis]);
      }
    }
  return box;
}

std::uint64_t blocks_in(const MapKeyBox& box, const MapPageKey& page, std::uint64_t blocks) {
  const MapBlockKey first = block_key(page, 0), last = block_key(page, kMapPageBlocks - 1);
  bool apart = false, inside = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    apart |= last[axis] < box.min[axis] || first[axis] > box.max[axis];
    inside &= first[axis] >= box.min[axis] && last[axis] <= box.max[axis];
  }
  if (apart || inside) return apart ? 0 : blocks;
  std::uint64_t chosen = 0;
  for (std::uint64_t left = blocks; left != 0; left &= left - 1) {
    const int block = std::countr_zero(left);
    const MapBlockKey key = block_key(page, block);
    bool in = true;
    for (std::size_t axis = 0; axis < 3; ++axis)
      in &= key[axis] >= box.min[axis] && key[axis] <= box.max[axis];
    if (in) chosen |= std::uint64_t{1} << static_cast<unsigned>(block);
  }
  return chosen;
}

}  // namespace hm
