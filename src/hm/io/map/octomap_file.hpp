#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/image.hpp"
#include "hm/geometry/occupancy.hpp"

namespace hm {

/// Known voxels as OctoMap holds them.
struct OctomapContent {
  double resolution_m = 0;             ///< edge of the smallest voxel
  std::vector<OccupancyVoxel> voxels;  ///< leaves; pruned ones are larger than the resolution
};

/// Writes voxels in OctoMap's format of the path's extension: `.bt` (free and occupied only) or `.ot` (with
/// log-odds, clamped to OctoMap's 0.1192 and 0.971; an occupied voxel gets at least 0, a free one less than
/// that, as OctoMap's threshold of 0.5 wants it). A voxel wider than the resolution fills all cells whose
/// centres it holds; unknown ones are left out; where several fall into one cell, the likeliest obstacle
/// wins. Eight equal cells become one. Errors: another extension, a resolution that is not positive, a voxel
/// beyond the octree (32768 cells from the origin) or more than 2^28 cells (kInvalidValue: other files of the
/// map can still be written), a refusing disk.
Result<void> write_octomap(const std::filesystem::path& path, std::span<const OccupancyVoxel> voxels,
                           double resolution_m);

/// Writes a ColorOcTree: write_octomap() with a colour for each voxel; the extension is `.ot`. A node that is
/// not opened has the mean colour of what is occupied in it.
Result<void> write_color_octomap(const std::filesystem::path& path, std::span<const OccupancyVoxel> voxels,
                                 std::span<const Rgb8> colors, double resolution_m);

/// Reads `.bt` and `.ot` files (OcTree; other trees are kUnsupported). Errors name the byte.
Result<OctomapContent> read_octomap(const std::filesystem::path& path);

}  // namespace hm
