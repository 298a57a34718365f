#pragma once
#include <filesystem>

#include "hm/core/result.hpp"
#include "hm/geometry/occupancy_grid_2d.hpp"

namespace hm {

enum class OccupancyGridMode {
  kTrinary,  ///< 0: occupied (50 % and more), 254: free, 205: unknown, as map_server writes
  kRaw,      ///< percent, 255: unknown
};

/// map_server's pair of files.
struct OccupancyGridFiles {
  std::filesystem::path description, image;
};

/// The pair to which a name belongs, its extension in any letter case: .yaml or .yml (the image beside it is
/// a .pgm), or .pgm (its description is a .yaml). Error (kUsage) for another extension.
Result<OccupancyGridFiles> occupancy_grid_files(const std::filesystem::path& path);

/// Writes a grid as map_server's pair of files, of which `path` names one (occupancy_grid_files()): the
/// description, and a binary PGM, top row first. Error for another extension, an empty grid, or when a file
/// cannot be written.
Result<void> write_occupancy_grid(const std::filesystem::path& path, const OccupancyGrid2D& grid,
                                  OccupancyGridMode mode = OccupancyGridMode::kTrinary);

/// Reads map_server's pair of files: PGM in binary or ASCII, modes `trinary`, `scale` and `raw`, `negate`,
/// comments. The image path in the YAML is relative to it. An origin with non-zero yaw is an error
/// (kUnsupported); errors name file and line or byte offset.
Result<OccupancyGrid2D> read_occupancy_grid(const std::filesystem::path& path);

}  // namespace hm
