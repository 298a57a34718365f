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

/// Totals over all pages. The digest depends on every key, mask and checksum, but not on their order.
struct MapDirectorySummary {
  std::uint64_t pages = 0;
  std::uint64_t blocks = 0;
  std::uint64_t digest = 0;
  std::int64_t last_row = 0;  ///< largest row number
  bool operator==(const MapDirectorySummary&) const = default;
};

/// All pages of a file, sorted by z, y, x.
using MapDirectory = std::map<MapPageKey, MapPageEntry>;

MapDirectorySummary summarise(const MapDirectory& directory);

/// Reads the directory from its index. Error when it is damaged or contains a page twice.
Result<MapDirectory> read_directory(SqliteDatabase& database, const std::string& where);
/// Reads the directory row by row without the index, skipping damaged rows.
MapDirectory salvage_directory(SqliteDatabase& database, std::int64_t last_row);

/// Bounding box of all block keys; nothing when there are no blocks.
std::optional<MapKeyBox> bounds(const MapDirectory& directory);
/// Bit mask of the page's blocks that lie in the box.
std::uint64_t blocks_in(const MapKeyBox& box, const MapPageKey& page, std::uint64_t blocks);

}  // namespace hm
