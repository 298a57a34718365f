#include "hm/tsdf/projection_integrator.hpp"

#include <algorithm>
#include <array>

#include "hm/core/stopwatch.hpp"
#include "hm/tsdf/volume_upkeep.hpp"

namespace hm {

ProjectionIntegrator::ProjectionIntegrator(const TsdfParams& params, const DepthNoise& noise,
                                           const PinholeCamera& camera)
    : params_(params), noise_(noise), camera_(camera) {}

void ProjectionIntegrator::integrate(VolumeGrid& grid, const RgbdFrame& frame, const ParallelLoop& loop,
                                     ScanStats& stats) {
  const Stopwatch total;
  const SE3& T_world_camera = *frame.T_world_camera;
  prepare_depth(frame.depth, params_, EdgeRule(params_, noise_, camera_, frame.depth.unit_m), loop, prepared_);
  stats.pixels_seen = frame.depth.units.size();
  stats.pixels_in_range = prepared_.pixels_in_range;
  const SE3 T_camera_world = T_world_camera.inverse();
  ProjectionScan scan = make_projection_scan(camera_, T_camera_world, params_, noise_);
  scan.depth_m = prepared_.depth_m.data();
  scan.tile_min_m = prepared_.tile_min_m.data();
  const bool with_color = params_.color && !frame.color.empty();
  if (with_color) scan.rgb = reinterpret_cast<const std::uint8_t*>(frame.color.data());

  finder_.find(prepared_, camera_, T_world_camera, params_, scan.truncation, candidates_);
  const DepthBounds bounds(prepared_, camera_, T_camera_world, params_, scan.truncation);
  stale_.clear();
  if (params_.carving) find_stale_volumes(grid, T_world_camera, bounds);
  allocate(grid, bounds, with_color, stats);
  stats.allocate_ms = total.milliseconds();

  Stopwatch stage;
  project(scan, loop);
  stats.integrate_ms = stage.milliseconds();

  stage.restart();
  settle(grid, stats);
  stats.carve_ms = stage.milliseconds();
  stats.total_ms = total.milliseconds();
}

/// Space carving's volumes (4.2.3): those in the frustum that may hold voxels on or behind a surface,
/// lie in front of what is measured now, and are not looked at anyway. The cost follows the frustum.
void ProjectionIntegrator::find_stale_volumes(const VolumeGrid& grid, const SE3& T_world_camera,
                                              const DepthBounds& bounds) {
  Box3 frustum;
  frustum.extend(T_world_camera.translation());
  for (const Vec2& corner : {Vec2(-0.5, -0.5), Vec2(camera_.width - 0.5, -0.5), Vec2(-0.5, camera_.height - 0.5),
                             Vec2(camera_.width - 0.5, camera_.height - 0.5)})
    frustum.extend(T_world_camera * camera_.unproject(corner, params_.far_m));
  interior_.clear();
  grid.find_interior(frustum, interior_);
  for (const VolumeKey key : interior_)
    if (bounds.may_be_seen_through(key)) stale_.push_back(key);
  const auto order = [](VolumeKey a, VolumeKey b) {
    return std::array{a.z, a.y, a.x} < std::array{b.z, b.y, b.x};
  };
  std::sort(stale_.begin(), stale_.end(), order);
  std::vector<VolumeKey> only_stale;
  std::set_difference(stale_.begin(), stale_.end(), candidates_.begin(), candidates_.end(),
                      std::back_inserter(only_stale), order);
  stale_.swap(only_stale);
}

void ProjectionIntegrator::allocate(VolumeGrid& grid, const DepthBounds& bounds, bool with_color,
                                    ScanStats& stats) {
  items_.clear();
  items_.reserve(candidates_.size() + stale_.size());
  for (const VolumeKey key : candidates_) {
    const DepthBounds::Band band = bounds.band_of(key);
    Item item;
    item.volume = grid.find(key);
    const bool may_carve = params_.carving && item.volume && grid.may_hold_interior(key);
    if (band.empty() && !may_carve) continue;
    if (!item.volume) {
      item.volume = grid.allocate(key);
      item.created = item.volume != nullptr;
    }
    if (!item.volume) {
      ++stats.volumes_refused;
      continue;
    }
    if (with_color && !item.volume->colors) item.colors_created = grid.allocate_colors(*item.volume);
    item.task = {key, item.volume->voxels, with_color ? item.volume->colors : nullptr, band.near_m, band.far_m,
                 may_carve};
    // Where something is to be carved, voxels outside of the band count too: see ProjectionTask.
    if (band.empty()) item.task.hit_near_m = PreparedDepth::kFarM;
    if (band.empty() || (may_carve && band.open)) item.task.hit_far_m = PreparedDepth::kFarM;
    items_.push_back(item);
  }
  stats.volumes_touched = items_.size();
  for (const VolumeKey key : stale_) {
    Item item;
    item.volume = grid.find(key);
    item.task = {key, item.volume->voxels, with_color ? item.volume->colors : nullptr};
    items_.push_back(item);
  }
}

void ProjectionIntegrator::project(const ProjectionScan& scan, const ParallelLoop& loop) {
  const auto kernel = params_.kernel == KernelChoice::kSimd ? project_volume_simd : project_volume_scalar;
  loop.for_ranges(items_.size(), 32, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) items_[i].update = kernel(scan, items_[i].task);
  });
}

/// Notes what changed, and gives back what turned out to hold nothing.
void ProjectionIntegrator::settle(VolumeGrid& grid, ScanStats& stats) {
  for (const Item& item : items_) {
    const VolumeUpdate& update = item.update;
    stats.voxels_updated += update.updated;
    stats.voxels_carved += update.carved;
    if (item.colors_created && update.colored == 0) grid.release_unused_colors(*item.volume);
    if (item.created) {
      if (update.updated == 0) {
        grid.release_unused(item.task.key);
        continue;
      }
      ++stats.volumes_created;
    }
    if (update.interior_hit) grid.set_may_hold_interior(item.task.key, true);
    if (update.updated + update.carved > 0) stats.changed.push_back({item.task.key, update.border_layers, false});
  }
  // After all marks are set: a volume emptied by carving may go only if no neighbour needs it.
  std::vector<VolumeKey> released;
  for (const Item& item : items_)
    if (item.update.carved > 0) settle_carved_volume(grid, item.task.key, released);
  stats.volumes_released = released.size();
  add_released(released, stats.changed);
}

}  // namespace hm
