#include "hm/tsdf/projection/projection_scan.hpp"

#include <algorithm>

#include "hm/tsdf/projection/space_carving.hpp"
#include "hm/tsdf/projection/voxel_observation.hpp"
#include "hm/tsdf/update/discrete_update_filter.hpp"

namespace hm {

TruncationModel::TruncationModel(const TsdfParams& params, const DepthNoise& noise) {
  if (!params.dynamic_truncation) {
    constant = min_m = max_m = static_cast<float>(params.max_truncation_m());
    return;
  }
  quadratic = static_cast<float>(params.truncation_sigmas_ratio * noise.quadratic_per_m);
  linear = static_cast<float>(params.truncation_sigmas_ratio * noise.linear_ratio);
  constant = static_cast<float>(params.truncation_sigmas_ratio * noise.constant_m);
  min_m = static_cast<float>(params.min_truncation_voxel * params.voxel_size_m);
  max_m = static_cast<float>(params.max_truncation_voxel * params.voxel_size_m);
}

ProjectionScan make_projection_scan(const PinholeCamera& camera, const SE3& T_camera_world,
                                    const TsdfParams& params, const DepthNoise& noise) {
  ProjectionScan scan;
  scan.width = camera.width;
  scan.height = camera.height;
  scan.tiles_x = (camera.width + kTileSide - 1) / kTileSide;
  scan.max_u = static_cast<float>(camera.width) - 0.5f;
  scan.max_v = static_cast<float>(camera.height) - 0.5f;
  Mat3 K;
  K << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1;
  scan.H = K * T_camera_world.rotation();
  scan.h0 = K * T_camera_world.translation();
  scan.voxel_size_m = params.voxel_size_m;
  const Mat3 step = scan.H * params.voxel_size_m;
  for (int row = 0; row < 3; ++row) {
    for (int i = 0; i < 64; ++i)
      scan.lane[row][i] = static_cast<float>(step(row, 0) * (i & 7) + step(row, 1) * (i >> 3));
    scan.step_z[row] = static_cast<float>(step(row, 2));
  }
  scan.truncation = TruncationModel(params, noise);
  scan.carving_margin_m = static_cast<float>(params.kCarvingMargin_voxel * params.voxel_size_m);
  scan.carving_factor = params.carving ? static_cast<float>(params.carving_weight_ratio) : 0.0f;
  scan.distance_limit_m = static_cast<float>(params.distance_limit_m());
  scan.sdf_units_per_m = static_cast<float>(1.0 / params.sdf_unit_m());
  scan.stale_below = static_cast<std::int32_t>(0.5f * scan.truncation.min_m * scan.sdf_units_per_m);
  scan.weight_numerator = scan.truncation.min_m * static_cast<float>(kWeightOne);
  scan.edge_weight_numerator = scan.weight_numerator * static_cast<float>(params.edge_weight_ratio);
  scan.weight_cap = static_cast<float>(params.weight_cap_observations * kWeightOne);
  scan.color_band_m = static_cast<float>(params.kColorBand_voxel * params.voxel_size_m);
  scan.color_cap = static_cast<std::uint32_t>(params.color_cap_observations);
  return scan;
}

Eigen::Vector3f ProjectionScan::origin_of(VolumeKey key) const {
  const Vec3 centre = (Vec3(key.x, key.y, key.z) * kVolumeSide + Vec3::Constant(0.5)) * voxel_size_m;
  return (H * centre + h0).cast<float>();
}

namespace {

std::uint32_t pixel_rgb(const std::uint8_t* rgb, int pixel) {
  const std::uint8_t* p = rgb + 3 * static_cast<std::ptrdiff_t>(pixel);
  return static_cast<std::uint32_t>(p[0]) | static_cast<std::uint32_t>(p[1]) << 8u |
         static_cast<std::uint32_t>(p[2]) << 16u;
}

/// Updates a volume that intersects the hit region (Alg. 2).
void observe_volume(const ProjectionScan& scan, const ProjectionTask& task,
                    const VolumeObservations& observations, VolumeUpdate& update) {
  for (int i = 0; i < kVolumeVoxels; ++i) {
    const VoxelObservation& found = observations[static_cast<std::size_t>(i)];
    if (!found.valid || !found.in_range || found.u_m < -found.tau_m) continue;
    TsdfVoxel& voxel = task.voxels[i];
    const bool was_solid = voxel.weight() > 0 && voxel.sdf() <= 0;
    voxel = add_observation(voxel, found.sample(scan), found.weight, scan.weight_cap);
    update.border_layers |= border_layers_of(i & 7, i >> 3 & 7, i >> 6);
    if (!found.is_hit()) {
      ++update.freed;
      update.carved += scan.carving_factor > 0 && was_solid && voxel.sdf() > 0 ? 1u : 0u;
      continue;
    }
    ++update.updated;
    update.interior_hit |= voxel.sdf() <= 0;
    if (task.colors && found.u_m >= -scan.color_band_m && found.u_m <= scan.color_band_m) {
      task.colors[i] = add_color(task.colors[i], pixel_rgb(scan.rgb, found.pixel), scan.color_cap);
      ++update.colored;
    }
  }
}

}  // namespace

VolumeUpdate project_volume_scalar(const ProjectionScan& scan, const ProjectionTask& task) {
  const VolumeObservations observations = observe_voxels(scan, task.key);
  VolumeUpdate update;
  if (std::any_of(observations.begin(), observations.end(),
                  [](const VoxelObservation& found) { return found.is_hit(); }))
    observe_volume(scan, task, observations, update);
  else if (scan.carving_factor > 0 && task.may_carve)
    carve_volume(scan, task, observations, update);
  return update;
}

}  // namespace hm
