#pragma once
#include <memory>
#include <span>

#include "hm/core/parallel.hpp"
#include "hm/sensors/rgbd_frame.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"
#include "hm/tsdf/projection/scan_stats.hpp"
#include "hm/tsdf/tsdf_params.hpp"

namespace hm {

/// Point cloud measured from one position, for sensors without an organised depth image. `colors` is empty or
/// as long as `p_world_points`. Points that are not finite are counted and skipped.
struct PointScan {
  Vec3 p_world_origin = Vec3::Zero();
  std::span<const Eigen::Vector3f> p_world_points;
  std::span<const Rgb8> colors;
};

/// Writes scans into a volume grid (dissertation 4.3). Use one integrator per grid at a time. The result
/// depends only on the scans and their order, not on the number of threads.
class Integrator {
 public:
  /// `camera` must have no lens distortion (readers remove it). The loop must outlive the integrator.
  Integrator(const TsdfParams& params, const DepthNoise& noise, const PinholeCamera& camera,
             const ParallelLoop& loop);
  ~Integrator();
  Integrator(Integrator&&) noexcept;

  /// Creates a grid with the voxel size, unit and memory limit of these parameters.
  static VolumeGrid make_grid(const TsdfParams& params);

  /// Integrates a depth image with its pose by the method of the parameters. A frame without a rigid pose
  /// changes nothing; the statistics give the reason.
  ScanStats integrate(VolumeGrid& grid, const RgbdFrame& frame);
  /// The same with a pose that replaces the frame's own.
  ScanStats integrate(VolumeGrid& grid, const PosedFrame& posed);
  /// Integrates points by voxel traversal.
  ScanStats integrate(VolumeGrid& grid, const PointScan& scan);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
