#pragma once
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/sensors/rgbd_frame.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"
#include "hm/tsdf/integration/observation_graph.hpp"
#include "hm/tsdf/projection/projection_scan.hpp"
#include "hm/tsdf/projection/scan_stats.hpp"
#include "hm/tsdf/projection/volume_upkeep.hpp"

namespace hm {

struct PointScan;

/// Scan integration by voxel traversal (dissertation 4.3.1): every voxel on a ray is updated with u, the
/// length |x - o| of the ray minus the distance of the voxel's centre along it. Threads share the work
/// through the bipartite graph of volumes and observations (4.3.3).
class TraversalIntegrator {
 public:
  TraversalIntegrator(const TsdfParams& params, const DepthNoise& noise);

  void integrate(VolumeGrid& grid, const PointScan& scan, const ParallelLoop& loop, ScanStats& stats);
  /// Integrates every valid pixel as a point.
  void integrate(VolumeGrid& grid, const PosedFrame& posed, const PinholeCamera& camera,
                 const ParallelLoop& loop, ScanStats& stats);

 private:
  void take_rays(const PointScan& scan, ScanStats& stats);
  void allocate(VolumeGrid& grid, ScanStats& stats);
  void replay(const VolumeGrid& grid, std::size_t index);
  void observe(const ObservedRay& ray, const Eigen::Vector3i& voxel, ScannedVolume& item) const;

  TsdfParams params_;
  TruncationModel truncation_;
  bool with_color_ = false;
  Vec3 origin_ = Vec3::Zero();
  std::vector<ObservedRay> rays_;
  std::vector<std::uint32_t> ray_rgb_;
  ObservationGraph graph_;
  std::vector<ScannedVolume> items_;
  std::vector<Eigen::Vector3f> points_;
  std::vector<Rgb8> colors_;
};

}  // namespace hm
