#include "hm/tsdf/integration/traversal_integrator.hpp"

#include <cmath>

#include "hm/core/stopwatch.hpp"
#include "hm/tsdf/integration/integrator.hpp"
#include "hm/tsdf/integration/ray_walk.hpp"
#include "hm/tsdf/update/discrete_update_filter.hpp"

namespace hm {

TraversalIntegrator::TraversalIntegrator(const TsdfParams& params, const DepthNoise& noise)
    : params_(params), truncation_(params, noise) {}

void TraversalIntegrator::integrate(VolumeGrid& grid, const PosedFrame& posed, const PinholeCamera& camera,
                                    const ParallelLoop& loop, ScanStats& stats) {
  const auto& [frame, T_world_camera] = posed;
  points_.clear();
  colors_.clear();
  for (int y = 0; y < frame.depth.height(); ++y)
    for (int x = 0; x < frame.depth.width(); ++x) {
      const double depth = frame.depth.depth_m(x, y);
      if (depth < params_.near_m || depth > params_.far_m) continue;
      points_.push_back((T_world_camera * camera.unproject(Vec2(x, y), depth)).cast<float>());
      if (!frame.color.empty()) colors_.push_back(frame.color(x, y));
    }
  integrate(grid, PointScan{T_world_camera.translation(), points_, colors_}, loop, stats);
  stats.pixels_seen = frame.depth.units.size();
}

void TraversalIntegrator::integrate(VolumeGrid& grid, const PointScan& scan, const ParallelLoop& loop,
                                    ScanStats& stats) {
  const Stopwatch total;
  with_color_ = params_.color && !scan.colors.empty();
  take_rays(scan, stats);
  graph_.build(grid, rays_, {origin_, params_.carving}, loop);
  allocate(grid, stats);
  stats.allocate_ms = total.milliseconds();

  Stopwatch stage;
  loop.for_ranges(items_.size(), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) replay(grid, i);
  });
  stats.integrate_ms = stage.milliseconds();

  stage.restart();
  finalise_scan(grid, items_, stats);
  stats.carve_ms = stage.milliseconds();
  stats.total_ms = total.milliseconds();
}

void TraversalIntegrator::take_rays(const PointScan& scan, ScanStats& stats) {
  origin_ = scan.p_world_origin;
  rays_.clear();
  ray_rgb_.clear();
  for (std::size_t i = 0; i < scan.p_world_points.size(); ++i) {
    const Vec3 ray = scan.p_world_points[i].cast<double>() - origin_;
    const double length = ray.norm();
    // Readings were range-checked along the optical axis; along the ray they are longer.
    if (!std::isfinite(length) || length < params_.near_m || length > 2.0 * params_.far_m) continue;
    const float tau = truncation_.at(static_cast<float>(length));
    rays_.push_back(
        {ray / length, length, tau, round_to_even(truncation_.min_m * static_cast<float>(kWeightOne) / tau)});
    if (with_color_) {
      const Rgb8 c = scan.colors[i];
      ray_rgb_.push_back(static_cast<std::uint32_t>(c.r | c.g << 8 | c.b << 16));
    }
  }
  stats.pixels_seen = scan.p_world_points.size();
  stats.pixels_in_range = rays_.size();
}

void TraversalIntegrator::allocate(VolumeGrid& grid, ScanStats& stats) {
  items_.assign(graph_.volumes().size(), {});
  for (std::size_t i = 0; i < items_.size(); ++i) {
    const VolumeKey key = graph_.volumes()[i];
    ScannedVolume& item = items_[i];
    const VolumeGrid::Found found = grid.look_up(key);
    item.key = key;
    item.volume = grid.open(found);
    item.had_interior = found.may_hold_interior;
    if (!item.volume && graph_.is_hit(i)) {
      item.volume = grid.allocate(key);
      item.created = item.volume != nullptr;
    }
    if (!item.volume) {
      ++stats.volumes_refused;
      continue;
    }
    stats.volumes_touched += graph_.is_hit(i) ? 1 : 0;
    if (with_color_ && graph_.is_hit(i) && !item.volume->colors)
      item.colors_created = grid.allocate_colors(*item.volume);
  }
}

/// Traverses one volume's rays, in order, through its voxels.
void TraversalIntegrator::replay(const VolumeGrid& grid, std::size_t index) {
  ScannedVolume& item = items_[index];
  if (!item.volume) return;
  const Vec3 low = Vec3(item.key.x, item.key.y, item.key.z) * kVolumeSide,
             high = low + Vec3::Constant(kVolumeSide);
  const Vec3 origin_voxel = origin_ / grid.voxel_size_m();
  for (const std::uint32_t i : graph_.observations(index)) {
    const ObservedRay& ray = rays_[i];
    const CellRay cells{origin_voxel, ray.direction / grid.voxel_size_m()};
    double t_begin = params_.carving ? 0.0 : std::max(ray.length_m - ray.tau_m, 0.0);
    double t_end = ray.length_m + ray.tau_m;
    clip_to_box(cells, low, high, t_begin, t_end);
    walk_cells(cells, t_begin, t_end,
               [&](const Eigen::Vector3i& voxel, double) { observe(ray, voxel, item); });
  }
  if (item.update.carved > 0) note_contents(item);
}

/// One voxel on one ray: hit region, carving region or neither (Algorithm 1).
void TraversalIntegrator::observe(const ObservedRay& ray, const Eigen::Vector3i& voxel,
                                  ScannedVolume& item) const {
  const Eigen::Vector3i in =
      voxel - Eigen::Vector3i(item.volume->key.x, item.volume->key.y, item.volume->key.z) * kVolumeSide;
  if (((in.array() < 0) || (in.array() >= kVolumeSide)).any()) return;  // a corner cut short by rounding
  const Vec3 centre = (voxel.cast<double>() + Vec3::Constant(0.5)) * params_.voxel_size_m;
  const auto u = static_cast<float>(ray.length_m - (centre - origin_).dot(ray.direction));
  const int offset = voxel_offset(in.x(), in.y(), in.z());
  TsdfVoxel& stored = item.volume->voxels[offset];
  const float margin = static_cast<float>(params_.kCarvingMargin_voxel * params_.voxel_size_m);
  if (u >= -ray.tau_m && u <= ray.tau_m) {
    const float cap = static_cast<float>(params_.weight_cap_observations * kWeightOne);
    const auto limit_m = static_cast<float>(params_.distance_limit_m());
    const float told_m = std::clamp(u, -limit_m, limit_m);
    stored = add_observation(stored, round_to_even(told_m / static_cast<float>(params_.sdf_unit_m())),
                             ray.weight, cap);
    ++item.update.updated;
    item.update.interior_hit |= stored.sdf() <= 0;
    const auto band = static_cast<float>(params_.kColorBand_voxel * params_.voxel_size_m);
    if (with_color_ && item.volume->colors && u >= -band && u <= band) {
      ColorVoxel& color = item.volume->colors[offset];
      color = add_color(color, ray_rgb_[static_cast<std::size_t>(&ray - rays_.data())],
                        static_cast<std::uint32_t>(params_.color_cap_observations));
      ++item.update.colored;
    }
  } else if (params_.carving && u > ray.tau_m + margin && stored.weight() > 0 && stored.sdf() <= 0) {
    stored =
        take_weight(stored, round_to_even(ray.weight * static_cast<float>(params_.carving_weight_ratio)));
    ++item.update.carved;
  } else {
    return;
  }
  item.update.border_layers |= border_layers_of(in.x(), in.y(), in.z());
}

}  // namespace hm
