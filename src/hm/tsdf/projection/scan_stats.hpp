#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "hm/tsdf/grid/volume.hpp"

namespace hm {

/// A volume whose voxels changed, and on which of its border layers: bit 0..5 = low x, high x, low y,
/// high y, low z, high z (a "layer" is the outermost voxel layer on that side).
struct ChangedVolume {
  VolumeKey key;
  std::uint8_t border_layers = 0;
  bool released = false;  ///< it is no longer in the grid
};

/// What one scan did to the grid. Times in milliseconds.
struct ScanStats {
  std::size_t pixels_seen = 0;      ///< pixels or points handed in
  std::size_t pixels_in_range = 0;  ///< with a reading between near and far
  std::size_t volumes_touched = 0;  ///< examined near the surface
  std::size_t volumes_created = 0;
  std::size_t volumes_released = 0;
  std::size_t volumes_refused = 0;  ///< not made because of the memory cap
  std::size_t voxels_updated = 0;
  std::size_t voxels_carved = 0;
  double allocate_ms = 0, integrate_ms = 0, carve_ms = 0, total_ms = 0;
  /// Why nothing was integrated, in words with numbers; empty when something was.
  std::string nothing_integrated_because;
  /// The memory that could not be had, with the remedy; empty when there was enough. The grid may then hold
  /// part of the scan: nothing more should be integrated.
  std::string out_of_memory;
  /// The volumes that changed, sorted by z, y, x.
  std::vector<ChangedVolume> changed;
};

}  // namespace hm
