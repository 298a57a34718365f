#include "hm/tsdf/projection/voxel_observation.hpp"

#include <algorithm>

#include "hm/tsdf/update/discrete_update_filter.hpp"

namespace hm {
namespace {

/// `h`: the voxel's homogeneous pixel coordinates.
VoxelObservation observe(const ProjectionScan& scan, const float (&h)[3]) {
  VoxelObservation found;
  found.z_m = h[2];
  if (!(h[2] > 0.0f)) return found;
  const float inverse = 1.0f / h[2];
  const float u = h[0] * inverse, v = h[1] * inverse;
  if (!(u >= -0.5f && u < scan.max_u && v >= -0.5f && v < scan.max_v)) return found;
  const int column = static_cast<int>(round_to_even(u)), row = static_cast<int>(round_to_even(v));
  found.pixel = row * scan.width + column;
  found.tile = row / kTileSide * scan.tiles_x + column / kTileSide;
  const float signed_depth = scan.depth_m[found.pixel];
  const bool at_edge = signed_depth < 0.0f;
  const float depth = at_edge ? -signed_depth : signed_depth;
  found.valid = depth > 0.0f;
  found.in_range = depth < PreparedDepth::kFarM;
  found.u_m = depth - h[2];
  found.tau_m = scan.truncation.at(depth);
  found.weight =
      observation_weight(at_edge ? scan.edge_weight_numerator : scan.weight_numerator, found.tau_m);
  return found;
}

}  // namespace

float VoxelObservation::sample(const ProjectionScan& scan) const {
  return round_to_even(std::clamp(u_m, -scan.distance_limit_m, scan.distance_limit_m) * scan.sdf_units_per_m);
}

VolumeObservations observe_voxels(const ProjectionScan& scan, VolumeKey key) {
  const Eigen::Vector3f origin = scan.origin_of(key);
  VolumeObservations observations;
  for (int i = 0; i < kVolumeVoxels; ++i) {
    float h[3];
    for (int row = 0; row < 3; ++row)
      h[row] = (origin[row] + static_cast<float>(i >> 6) * scan.step_z[row]) + scan.lane[row][i & 63];
    observations[static_cast<std::size_t>(i)] = observe(scan, h);
  }
  return observations;
}

}  // namespace hm
