#include "hm/tsdf/projection/projection_integrator.hpp"

#include <algorithm>
#include <array>
#include <iterator>

#include <fmt/format.h>

#include "hm/core/stopwatch.hpp"

namespace hm {
namespace {

bool before(VolumeKey a, VolumeKey b) { return std::array{a.z, a.y, a.x} < std::array{b.z, b.y, b.x}; }

}  // namespace

ProjectionIntegrator::ProjectionIntegrator(const TsdfParams& params, const DepthNoise& noise,
                                           const PinholeCamera& camera)
    : params_(params), noise_(noise), camera_(camera) {}

void ProjectionIntegrator::integrate(VolumeGrid& grid, const PosedFrame& posed, const ParallelLoop& loop,
                                     ScanStats& stats) {
  const Stopwatch total;
  const auto& [frame, T_world_camera] = posed;
  const bool with_color = params_.color && !frame.color.empty();
  const SE3 T_camera_world = T_world_camera.inverse();
  ProjectionScan scan = make_projection_scan(camera_, T_camera_world, params_, noise_);
  RawDepth raw(frame.depth, params_, EdgeRule(params_, noise_, camera_, frame.depth.unit_m), scan);
  if (with_color) raw.color = &frame.color;
  prepare_depth(raw, loop, prepared_);
  stats.pixels_seen = frame.depth.units.size();
  stats.pixels_in_range = prepared_.pixels_in_range;
  scan.depth_m = prepared_.depth_m.data();
  scan.tile_min_m = prepared_.tile_min_m.data();
  if (with_color) scan.rgb = reinterpret_cast<const std::uint8_t*>(frame.color.data());

  candidates_.clear();
  if (!finder_.find({prepared_, camera_, T_world_camera, params_.voxel_size_m, scan.truncation}, loop,
                    candidates_)) {
    stats.nothing_integrated_because = fmt::format(
        "its readings span {:.0f} volumes of {:.3g} m, which to search would take {:.0f} MB: raise "
        "tsdf.voxel_size_m = {} or lower tsdf.far_m = {}",
        finder_.volumes_spanned(), params_.voxel_size_m * kVolumeSide, 1e-6 * finder_.bitmap_bytes(),
        params_.voxel_size_m, params_.far_m);
    return;
  }
  bounds_.build(prepared_, scan, camera_, loop);
  stale_.clear();
  if (params_.carving) find_stale_volumes(grid, T_world_camera);
  examine(grid, loop);
  allocate(grid, with_color, stats);
  stats.allocate_ms = total.milliseconds();

  Stopwatch stage;
  project(scan, loop);
  stats.integrate_ms = stage.milliseconds();

  stage.restart();
  finalise_scan(grid, scanned_, stats);
  stats.carve_ms = stage.milliseconds();
  stats.total_ms = total.milliseconds();
}

/// Finds the volumes for space carving (4.2.3): visible ones that may hold voxels on or behind a surface, and
/// are not candidates anyway. The cost depends on the frustum, not on the map.
void ProjectionIntegrator::find_stale_volumes(const VolumeGrid& grid, const SE3& T_world_camera) {
  Box3 frustum;
  frustum.extend(T_world_camera.translation());
  for (const Vec2& corner :
       {Vec2(-0.5, -0.5), Vec2(camera_.width - 0.5, -0.5), Vec2(-0.5, camera_.height - 0.5),
        Vec2(camera_.width - 0.5, camera_.height - 0.5)})
    frustum.extend(T_world_camera * camera_.unproject(corner, params_.far_m));
  grid.find_interior(frustum, stale_);
  std::erase_if(stale_, [&](VolumeKey key) { return finder_.found(key); });
  bounds_.drop_unseen(stale_);
  std::sort(stale_.begin(), stale_.end(), before);
}

/// Determines the position of the parts of each volume relative to the measured surface, and looks up the
/// volume in the grid.
void ProjectionIntegrator::examine(VolumeGrid& grid, const ParallelLoop& loop) {
  prospects_.clear();
  for (const VolumeKey key : candidates_) prospects_.push_back({key, true, {}, {}});
  for (const VolumeKey key : stale_) prospects_.push_back({key, false, {}, {}});
  std::inplace_merge(prospects_.begin(), prospects_.begin() + std::ssize(candidates_), prospects_.end(),
                     [](const Prospect& a, const Prospect& b) { return before(a.key, b.key); });
  loop.for_ranges(prospects_.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      prospects_[i].parts = bounds_.parts_of(prospects_[i].key);
      prospects_[i].found = grid.look_up(prospects_[i].key);
    }
  });
}

void ProjectionIntegrator::allocate(VolumeGrid& grid, bool with_color, ScanStats& stats) {
  scanned_.clear();
  tasks_.clear();
  for (const Prospect& prospect : prospects_) {
    const bool may_carve = params_.carving && prospect.found.may_hold_interior;
    const bool near_surface = prospect.near_surface && prospect.parts.in_band != 0;
    if (!near_surface && !(may_carve && (prospect.parts.in_front | prospect.parts.in_band) != 0)) continue;
    ScannedVolume scanned;
    scanned.key = prospect.key;
    scanned.volume = grid.open(prospect.found);
    scanned.had_interior = prospect.found.may_hold_interior;
    if (!scanned.volume) {
      scanned.volume = grid.allocate(prospect.key);
      scanned.created = scanned.volume != nullptr;
    }
    if (!scanned.volume) {
      ++stats.volumes_refused;
      continue;
    }
    if (with_color && prospect.near_surface && !scanned.volume->colors)
      scanned.colors_created = grid.allocate_colors(*scanned.volume);
    stats.volumes_touched += prospect.near_surface ? 1 : 0;
    scanned_.push_back(scanned);
    tasks_.push_back({prospect.key, scanned.volume->voxels, with_color ? scanned.volume->colors : nullptr,
                      prospect.parts, may_carve});
  }
}

void ProjectionIntegrator::project(const ProjectionScan& scan, const ParallelLoop& loop) {
  const auto kernel = params_.kernel == KernelChoice::kSimd ? project_volume_simd : project_volume_scalar;
  loop.for_ranges(tasks_.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      scanned_[i].update = kernel(scan, tasks_[i]);
      if (scanned_[i].update.carved > 0) note_contents(scanned_[i]);
    }
  });
}

double ProjectionIntegrator::bytes_wanted() const {
  const double per_volume = sizeof(VolumeKey) + sizeof(Prospect) + sizeof(ScannedVolume) +
                            sizeof(ProjectionTask) + sizeof(TsdfVoxel) * kVolumeVoxels +
                            (params_.color ? sizeof(ColorVoxel) * kVolumeVoxels : 0);
  return finder_.bitmap_bytes() + per_volume * static_cast<double>(candidates_.size());
}

}  // namespace hm
