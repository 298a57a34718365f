#pragma once
#include <filesystem>

#include "hm/core/result.hpp"
#include "hm/geometry/occupancy_grid_2d.hpp"

namespace hm {

enum class OccupancyGridMode {
  kTrinary,  ///< 0 for occupied (50 % and more), 254 for free, 205 for unknown: what map_server writes
  kRaw,      ///< percent as they are, 255 for unknown
};

/// Writes a grid as map_server's pair of files: `path` (.yaml) and a binary PGM of the same name beside it,
/// top row first. An error for another extension, an empty grid, or when the disk refuses.
Result<void> write_occupancy_grid(const std::filesystem::path& path, const OccupancyGrid2D& grid,
                                  OccupancyGridMode mode = OccupancyGridMode::kTrinary);

/// Reads such a pair: PGM in binary or ASCII, modes `trinary`, `scale` and `raw`, `negate`, comments. The
/// image is the one that the YAML names, relative to it. A map turned by a yaw is an error (kUnsupported);
/// errors name file and line or byte offset.
Result<OccupancyGrid2D> read_occupancy_grid(const std::filesystem::path& path);

}  // namespace hm
