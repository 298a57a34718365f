#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "hm/tsdf/grid/volume.hpp"

namespace hm {

/// Volume whose voxels changed, and its changed border layers: bit 0..5 = low x, high x, low y, high y, low
/// z, high z (the outermost voxel layer on that side).
struct ChangedVolume {
  VolumeKey key;
  std::uint8_t border_layers = 0;
  bool released = false;  ///< it is no longer in the grid
};

/// Statistics of integrating one scan. Times in milliseconds.
struct ScanStats {
  std::size_t pixels_seen = 0;      ///< number of input pixels or points
  std::size_t pixels_in_range = 0;  ///< with a reading between near and far
  std::size_t volumes_touched = 0;  ///< examined near the surface
  std::size_t volumes_created = 0;
  std::size_t volumes_released = 0;
  std::size_t volumes_refused = 0;  ///< not created because of the memory limit
  std::size_t voxels_updated = 0;
  std::size_t voxels_carved = 0;
  double allocate_ms = 0, integrate_ms = 0, carve_ms = 0, total_ms = 0;
  /// Reason why nothing was integrated; empty otherwise.
  std::string nothing_integrated_because;
  /// Message about missing memory, with the remedy; empty when there was enough. If set, the grid may hold
  /// only part of the scan, and integration should end.
  std::string out_of_memory;
  /// Changed volumes, sorted by z, y, x.
  std::vector<ChangedVolume> changed;
};

}  // namespace hm
