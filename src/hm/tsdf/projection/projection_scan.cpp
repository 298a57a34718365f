#include "hm/tsdf/projection/projection_scan.hpp"

#include <algorithm>
#include <array>

#include "hm/tsdf/projection/discrete_update_filter.hpp"

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

/// Pixel of a voxel and its distance in front of the measured surface.
struct Lookup {
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
  [[nodiscard]] float sample(const ProjectionScan& scan) const {
    return round_to_even(std::clamp(u_m, -scan.distance_limit_m, scan.distance_limit_m) *
                         scan.sdf_units_per_m);
  }
};
using VoxelLookups = std::array<Lookup, kVolumeVoxels>;

Lookup look_up(const ProjectionScan& scan, const float (&h)[3]) {
  Lookup found;
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

std::uint32_t pixel_rgb(const std::uint8_t* rgb, int pixel) {
  const std::uint8_t* p = rgb + 3 * static_cast<std::ptrdiff_t>(pixel);
  return static_cast<std::uint32_t>(p[0]) | static_cast<std::uint32_t>(p[1]) << 8u |
         static_cast<std::uint32_t>(p[2]) << 16u;
}

/// Updates a volume that intersects the hit region (Alg. 2).
void observe_volume(const ProjectionScan& scan, const ProjectionTask& task, const VoxelLookups& lookups,
                    VolumeUpdate& update) {
  for (int i = 0; i < kVolumeVoxels; ++i) {
    const Lookup& found = lookups[static_cast<std::size_t>(i)];
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

/// Space carving (4.2.3) in one volume.
void carve_volume(const ProjectionScan& scan, const ProjectionTask& task, const VoxelLookups& lookups,
                  VolumeUpdate& update) {
  for (int i = 0; i < kVolumeVoxels; ++i) {
    const Lookup& found = lookups[static_cast<std::size_t>(i)];
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

}  // namespace

VolumeUpdate project_volume_scalar(const ProjectionScan& scan, const ProjectionTask& task) {
  const Eigen::Vector3f origin = scan.origin_of(task.key);
  VoxelLookups lookups;
  for (int i = 0; i < kVolumeVoxels; ++i) {
    float h[3];
    for (int row = 0; row < 3; ++row)
      h[row] = (origin[row] + static_cast<float>(i >> 6) * scan.step_z[row]) + scan.lane[row][i & 63];
    lookups[static_cast<std::size_t>(i)] = look_up(scan, h);
  }
  VolumeUpdate update;
  if (std::any_of(lookups.begin(), lookups.end(), [](const Lookup& found) { return found.is_hit(); }))
    observe_volume(scan, task, lookups, update);
  else if (scan.carving_factor > 0 && task.may_carve)
    carve_volume(scan, task, lookups, update);
  return update;
}

}  // namespace hm
