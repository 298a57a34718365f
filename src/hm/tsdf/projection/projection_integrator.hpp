#pragma once
#include <optional>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/sensors/rgbd_frame.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"
#include "hm/tsdf/projection/candidate_volumes.hpp"
#include "hm/tsdf/projection/depth_bounds.hpp"
#include "hm/tsdf/projection/depth_preparation.hpp"
#include "hm/tsdf/projection/scan_stats.hpp"
#include "hm/tsdf/projection/volume_upkeep.hpp"

namespace hm {

/// Scan integration by voxel projection (dissertation 4.3.2, Algorithm 2).
class ProjectionIntegrator {
 public:
  ProjectionIntegrator(const TsdfParams& params, const DepthNoise& noise, const PinholeCamera& camera);

  /// Integrates a frame; its pose must be rigid and its size the camera's.
  void integrate(VolumeGrid& grid, const PosedFrame& posed, const ParallelLoop& loop, ScanStats& stats);
  /// Upper bound of the memory needed by the last scan in bytes: its bitmap and its volumes.
  [[nodiscard]] double bytes_wanted() const;

 private:
  void find_stale_volumes(const VolumeGrid& grid, const SE3& T_world_camera);
  void examine(VolumeGrid& grid, const ParallelLoop& loop);
  void allocate(VolumeGrid& grid, bool with_color, ScanStats& stats);
  void project(const ProjectionScan& scan, const ParallelLoop& loop);

  /// Volume that may be updated in this scan.
  struct Prospect {
    VolumeKey key;
    bool near_surface = false;  ///< else only carved
    PartMasks parts;
    VolumeGrid::Found found;
  };

  TsdfParams params_;
  DepthNoise noise_;
  PinholeCamera camera_;
  PreparedDepth prepared_;
  CandidateFinder finder_;
  DepthBounds bounds_;
  std::vector<VolumeKey> candidates_, stale_;
  std::vector<Prospect> prospects_;
  std::vector<ScannedVolume> scanned_;  ///< and the task of each:
  std::vector<ProjectionTask> tasks_;
};

}  // namespace hm
