#pragma once
#include <array>

#include "hm/tsdf/projection/projection_scan.hpp"

namespace hm {

/// Observation of one voxel by a depth image: its pixel, and its distance in front of the surface measured
/// there (4.2.1).
struct VoxelObservation {
  bool valid = false;
  bool in_range = false;  ///< the reading is not beyond far
  int pixel = 0;          ///< index into the depth image
  int tile = 0;
  float z_m = 0;  ///< the voxel's own depth
  float u_m = 0;  ///< measured depth - own depth: positive in front of the surface
  float tau_m = 0;
  float weight = 0;  ///< of an observation, in 1/kWeightOne

  [[nodiscard]] bool is_hit() const { return valid && in_range && u_m >= -tau_m && u_m <= tau_m; }
  /// Observed distance in sdf units, clamped to the distance limit.
  [[nodiscard]] float sample(const ProjectionScan& scan) const;
};
using VolumeObservations = std::array<VoxelObservation, kVolumeVoxels>;

/// Projects every voxel of a volume into the depth image (4.3.2).
VolumeObservations observe_voxels(const ProjectionScan& scan, VolumeKey key);

}  // namespace hm
