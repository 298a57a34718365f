#include "hm/tsdf/integration/integrator.hpp"

#include <new>

#include "hm/core/check.hpp"
#include "hm/tsdf/integration/traversal_integrator.hpp"
#include "hm/tsdf/projection/projection_integrator.hpp"

namespace hm {
namespace {

/// Poses farther out than this (metres) are invalid.
constexpr double kFarthestPose_m = 1e5;

/// Reason why a frame cannot be integrated at all, or empty.
std::string refusal(const PosedFrame& posed, const PinholeCamera& camera) {
  const RgbdFrame& frame = posed.frame;
  if (frame.depth.width() != camera.width || frame.depth.height() != camera.height)
    return fmt::format("the depth image is {} x {}, the camera {} x {}", frame.depth.width(),
                       frame.depth.height(), camera.width, camera.height);
  if (!frame.color.empty() && (frame.color.width() != camera.width || frame.color.height() != camera.height))
    return fmt::format("the colour image is {} x {}, the camera {} x {}", frame.color.width(),
                       frame.color.height(), camera.width, camera.height);
  if (!(frame.depth.unit_m > 0)) return fmt::format("the depth unit is {} m", frame.depth.unit_m);
  if (!is_rigid(posed.T_world_camera)) return "its pose is not a finite rigid motion";
  if (posed.T_world_camera.translation().cwiseAbs().maxCoeff() > kFarthestPose_m)
    return fmt::format("its pose is {:.3g} m from the origin", posed.T_world_camera.translation().norm());
  return {};
}

/// Explanation why a scan changed nothing.
std::string explanation(const ScanStats& stats, const TsdfParams& params) {
  if (stats.pixels_seen == 0) return "the scan is empty";
  if (stats.pixels_in_range == 0)
    return fmt::format("none of {} readings lies between {} m and {} m", stats.pixels_seen, params.near_m,
                       params.far_m);
  if (stats.volumes_refused > 0 && params.max_map_mb > 0)
    return fmt::format("the memory cap of {} MB is reached ({} blocks refused)", params.max_map_mb,
                       stats.volumes_refused);
  if (stats.volumes_refused > 0)
    return fmt::format("its {} blocks are too far from the origin for voxels of {} m", stats.volumes_refused,
                       params.voxel_size_m);
  return fmt::format("{} readings in range touched no voxel", stats.pixels_in_range);
}

/// Message when the system is out of memory.
std::string out_of_memory(const VolumeGrid& grid, double wanted_bytes, const TsdfParams& params) {
  const std::string asked = wanted_bytes > 0
                                ? fmt::format("a scan asks for up to {:.0f} MB beside", 1e-6 * wanted_bytes)
                                : std::string("a scan does not fit beside");
  return fmt::format(
      "out of memory: {} the map's {:.0f} MB; raise tsdf.voxel_size_m = {}, lower tsdf.far_m = {}, or set "
      "tsdf.max_map_mb below what is free",
      asked, 1e-6 * static_cast<double>(grid.map_bytes()), params.voxel_size_m, params.far_m);
}

}  // namespace

struct Integrator::Impl {
  TsdfParams params;
  PinholeCamera camera;
  const ParallelLoop* loop;
  ProjectionIntegrator projection;
  TraversalIntegrator traversal;

  void explain(ScanStats& stats) const {
    if (stats.voxels_updated == 0 && stats.nothing_integrated_because.empty())
      stats.nothing_integrated_because = explanation(stats, params);
  }
};

Integrator::Integrator(const TsdfParams& params, const DepthNoise& noise, const PinholeCamera& camera,
                       const ParallelLoop& loop)
    : impl_(new Impl{params, camera, &loop, ProjectionIntegrator(params, noise, camera),
                     TraversalIntegrator(params, noise)}) {
  HM_CHECK(check_params(params), "{}", check_params(params).error().message);
  HM_CHECK(camera.distortion.is_zero(), "the camera still has lens distortion");
}
Integrator::~Integrator() = default;
Integrator::Integrator(Integrator&&) noexcept = default;

VolumeGrid Integrator::make_grid(const TsdfParams& params) {
  return {params.voxel_size_m, params.sdf_unit_m(), static_cast<std::size_t>(params.max_map_mb) * 1'000'000u};
}

ScanStats Integrator::integrate(VolumeGrid& grid, const RgbdFrame& frame) {
  if (frame.T_world_camera) return integrate(grid, {frame, *frame.T_world_camera});
  ScanStats stats;
  stats.nothing_integrated_because = "it has no pose";
  return stats;
}

ScanStats Integrator::integrate(VolumeGrid& grid, const PosedFrame& posed) {
  ScanStats stats;
  stats.nothing_integrated_because = refusal(posed, impl_->camera);
  if (!stats.nothing_integrated_because.empty()) return stats;
  const bool projects = impl_->params.method == IntegrationMethod::kProjection;
  try {
    if (projects)
      impl_->projection.integrate(grid, posed, *impl_->loop, stats);
    else
      impl_->traversal.integrate(grid, posed, impl_->camera, *impl_->loop, stats);
  } catch (const std::bad_alloc&) {
    stats.out_of_memory = out_of_memory(grid, projects ? impl_->projection.bytes_wanted() : 0, impl_->params);
    stats.nothing_integrated_because = stats.out_of_memory;
  }
  impl_->explain(stats);
  return stats;
}

ScanStats Integrator::integrate(VolumeGrid& grid, const PointScan& scan) {
  HM_CHECK(scan.colors.empty() || scan.colors.size() == scan.p_world_points.size(),
           "{} colours for {} points", scan.colors.size(), scan.p_world_points.size());
  ScanStats stats;
  if (!scan.p_world_origin.allFinite()) {
    stats.nothing_integrated_because = "its origin is not finite";
    return stats;
  }
  try {
    impl_->traversal.integrate(grid, scan, *impl_->loop, stats);
  } catch (const std::bad_alloc&) {
    stats.out_of_memory = out_of_memory(grid, 0, impl_->params);
    stats.nothing_integrated_because = stats.out_of_memory;
  }
  impl_->explain(stats);
  return stats;
}

}  // namespace hm
