#include "hm/tsdf/projection/space_carving.hpp"

#include "hm/tsdf/update/discrete_update_filter.hpp"

namespace hm {

void carve_volume(const ProjectionScan& scan, const ProjectionTask& task,
                  const VolumeObservations& observations, VolumeUpdate& update) {
  for (int i = 0; i < kVolumeVoxels; ++i) {
    const VoxelObservation& found = observations[static_cast<std::size_t>(i)];
    TsdfVoxel& voxel = task.voxels[i];
    const float end_m = found.tau_m + scan.carving_margin_m;
    if (!found.valid || !(found.u_m > end_m) || voxel.weight() == 0 || voxel.sdf() >= scan.stale_below)
      continue;
    // Solid voxels well in front of all readings of their tile lose weight; others are updated as free.
    if (voxel.sdf() <= 0 && scan.tile_min_m[found.tile] - found.z_m > end_m)
      voxel = take_weight(voxel, round_to_even(found.weight * scan.carving_factor));
    else if (found.in_range)
      voxel = add_observation(voxel, found.sample(scan), found.weight, scan.weight_cap);
    else
      continue;
    ++update.carved;
    update.border_layers |= border_layers_of(i & 7, i >> 3 & 7, i >> 6);
  }
}

}  // namespace hm
