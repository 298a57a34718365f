#pragma once
#include <filesystem>

#include "hm/core/result.hpp"
#include "hm/geometry/occupancy_grid_2d.hpp"
#include "hm/mvog/multi_volume_grid.hpp"
#include "hm/pipeline/laser/laser_params.hpp"

namespace hm {

/// The horizontal part of a grid that scans see: between slice_bottom_m and slice_top_m; a map of one layer
/// as a whole.
Result<OccupancyGrid2D> laser_slice(const MultiVolumeGrid& map, const LaserRunParams& params);
/// True when all of a map lies within one layer, as scans without mirrors and tilt make it.
bool is_planar(const MultiVolumeGrid& map);

/// A map of an earlier run to find a vehicle in: a map_server yaml, a .mvog (its slice), or the folder of a
/// run with one of them. Errors: nothing there, not a map, damaged, or nothing occupied in it.
Result<OccupancyGrid2D> read_saved_laser_map(const std::filesystem::path& path, const LaserRunParams& params);

}  // namespace hm
