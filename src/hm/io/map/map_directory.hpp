#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/io/bytes/sqlite_database.hpp"
#include "hm/io/map/map_file.hpp"
#include "hm/io/map/map_page.hpp"

namespace hm {

/// What all pages add up to. The digest changes with every key, mask and checksum, whatever the order.
struct MapDirectorySummary {
  std::uint64_t pages = 0;
  std::uint64_t blocks = 0;
  std::uint64_t digest = 0;
  std::int64_t last_row = 0;  ///< no row number is larger
  bool operator==(const MapDirectorySummary&) const = default;
};

/// All pages of a file, in the order z, y, x.
using MapDirectory = std::map<MapPageKey, MapPageEntry>;

MapDirectorySummary summarise(const MapDirectory& directory);

/// Reads the directory from its index. An Error when it is damaged or holds a page twice.
Result<MapDirectory> read_directory(SqliteDatabase& database, const std::string& where);
/// Reads what is still readable row by row, without the index; damaged rows are left out.
MapDirectory salvage_directory(SqliteDatabase& database, std::int64_t last_row);

/// The box around all blocks; nothing when there are none.
std::optional<MapKeyBox> bounds(const MapDirectory& directory);
/// The page's blocks that lie in the box, one bit each.
std::uint64_t blocks_in(const MapKeyBox& box, const MapPageKey& page, std::uint64_t blocks);

}  // namespace hm
