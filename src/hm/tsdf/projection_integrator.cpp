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
  prepare_depth(frame.depth, params_, EdgeRule(params_, noise_, camera_, frame.depth.unit_m), loop,
                prepared_);
  stats.pixels_seen = frame.depth.units.size();
  stats.pixels_in_range = prepared_.pixels_in_range;
  const SE3 T_camera_world = T_world_camera.inverse();
  ProjectionScan scan = make_projection_scan(camera_, T_camera_world, params_, noise_);
  scan.depth_m = prepared_.depth_m.data();
  scan.tile_min_m = prepared_.tile_min_m.data();
  const bool with_color = params_.color && !frame.color.empty();
  if (with_color) scan.rgb = reinterpret_cast<const std::uint8_t*>(frame.color.data());

  finder_.find(prepared_, camera_, T_world_camera, params_, scan.truncation, loop, candidates_);
  bounds_.build(prepared_, scan, camera_);
  stale_.clear();
  if (params_.carving) find_stale_volumes(grid, T_world_camera);
  bound(loop);
  allocate(grid, with_color, stats);
  stats.allocate_ms = total.milliseconds();

  Stopwatch stage;
  project(scan, loop);
  stats.integrate_ms = stage.milliseconds();

  stage.restart();
  settle(grid, stats);
  stats.carve_ms = stage.milliseconds();
  stats.total_ms = total.milliseconds();
}

/// Space carving's volumes (4.2.3): those in the frustum that may hold voxels on or behind a surface, and
/// are not looked at anyway. The cost follows the frustum, never the map.
void ProjectionIntegrator::find_stale_volumes(const VolumeGrid& grid, const SE3& T_world_camera) {
  Box3 frustum;
  frustum.extend(T_world_camera.translation());
  for (const Vec2& corner :
       {Vec2(-0.5, -0.5), Vec2(camera_.width - 0.5, -0.5), Vec2(-0.5, camera_.height - 0.5),
        Vec2(camera_.width - 0.5, camera_.height - 0.5)})
    frustum.extend(T_world_camera * camera_.unproject(corner, params_.far_m));
  std::vector<VolumeKey> interior;
  grid.find_interior(frustum, interior);
  const auto order = [](VolumeKey a, VolumeKey b) {
    return std::array{a.z, a.y, a.x} < std::array{b.z, b.y, b.x};
  };
  std::sort(interior.begin(), interior.end(), order);
  std::set_difference(interior.begin(), interior.end(), candidates_.begin(), candidates_.end(),
                      std::back_inserter(stale_), order);
}

/// Where the parts of each volume lie against the measured surface.
void ProjectionIntegrator::bound(const ParallelLoop& loop) {
  const auto fill = [&](const std::vector<VolumeKey>& keys, std::vector<PartMasks>& parts) {
    parts.resize(keys.size());
    loop.for_ranges(keys.size(), 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) parts[i] = bounds_.parts_of(keys[i]);
    });
  };
  fill(candidates_, candidate_parts_);
  fill(stale_, stale_parts_);
}

void ProjectionIntegrator::allocate(VolumeGrid& grid, bool with_color, ScanStats& stats) {
  items_.clear();
  items_.reserve(candidates_.size() + stale_.size());
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    const VolumeKey key = candidates_[i];
    Item item;
    const bool may_carve = params_.carving && grid.may_hold_interior(key);
    if (candidate_parts_[i].in_band == 0 && !(may_carve && candidate_parts_[i].in_front != 0)) continue;
    item.volume = grid.find(key);
    if (!item.volume) {
      item.volume = grid.allocate(key);
      item.created = item.volume != nullptr;
    }
    if (!item.volume) {
      ++stats.volumes_refused;
      continue;
    }
    if (with_color && !item.volume->colors) item.colors_created = grid.allocate_colors(*item.volume);
    item.task = {key, item.volume->voxels, with_color ? item.volume->colors : nullptr, candidate_parts_[i],
                 may_carve};
    items_.push_back(item);
  }
  stats.volumes_touched = items_.size();
  for (std::size_t i = 0; i < stale_.size(); ++i) {
    if ((stale_parts_[i].in_front | stale_parts_[i].in_band) == 0) continue;
    Item item;
    item.volume = grid.find(stale_[i]);
    item.task = {stale_[i], item.volume->voxels, with_color ? item.volume->colors : nullptr, stale_parts_[i],
                 true};
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
        if (update.freed > 0)
          grid.release(item.task.key);  // free space alone is not worth a volume
        else
          grid.release_unused(item.task.key);
        continue;
      }
      ++stats.volumes_created;
    }
    if (update.interior_hit) grid.set_may_hold_interior(item.task.key, true);
    if (update.updated + update.freed + update.carved > 0)
      stats.changed.push_back({item.task.key, update.border_layers, false});
  }
  // After all marks are set: a volume emptied by carving may go only if no neighbour needs it.
  std::vector<VolumeKey> released;
  for (const Item& item : items_)
    if (item.update.carved > 0) settle_carved_volume(grid, item.task.key, released);
  stats.volumes_released = released.size();
  add_released(released, stats.changed);
}

}  // namespace hm
