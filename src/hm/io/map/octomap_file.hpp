#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/image.hpp"
#include "hm/geometry/occupancy.hpp"

namespace hm {

/// Known voxels of an OctoMap file.
struct OctomapContent {
  double resolution_m = 0;             ///< edge of the smallest voxel
  std::vector<OccupancyVoxel> voxels;  ///< leaves; pruned ones are larger than the resolution
};

/// Writes voxels in the OctoMap format of the path's extension: `.bt` (free and occupied only) or `.ot`
/// (log-odds, clamped to OctoMap's probabilities 0.1192 and 0.971; at least 0 for occupied voxels and below 0
/// for free ones, matching OctoMap's threshold of 0.5). A voxel wider than the resolution fills all cells
/// whose centres it contains; unknown voxels are skipped; where several fall into one cell, the most probable
/// obstacle wins. Eight equal cells are pruned. Errors: another extension, a resolution that is not positive,
/// a voxel outside the octree (32768 cells from the origin) or more than 2^28 cells (kInvalidValue), the file
/// cannot be written.
Result<void> write_octomap(const std::filesystem::path& path, std::span<const OccupancyVoxel> voxels,
                           double resolution_m);

/// Writes a ColorOcTree with a colour for each voxel; the extension is `.ot`. A pruned node has the mean
/// colour of its occupied voxels.
Result<void> write_color_octomap(const std::filesystem::path& path, std::span<const OccupancyVoxel> voxels,
                                 std::span<const Rgb8> colors, double resolution_m);

/// Reads `.bt` and `.ot` files (OcTree; other trees are kUnsupported). Errors name the byte.
Result<OctomapContent> read_octomap(const std::filesystem::path& path);

}  // namespace hm
