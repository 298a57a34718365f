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

  /// The frame must have a rigid pose and the camera's size.
  void integrate(VolumeGrid& grid, const PosedFrame& posed, const ParallelLoop& loop, ScanStats& stats);
  /// Memory that the last scan asks for at most, bytes: its bitmap and its volumes.
  [[nodiscard]] double bytes_wanted() const;

 private:
  void find_stale_volumes(const VolumeGrid& grid, const SE3& T_world_camera);
  void examine(VolumeGrid& grid, const ParallelLoop& loop);
  void allocate(VolumeGrid& grid, bool with_color, ScanStats& stats);
  void project(const ProjectionScan& scan, const ParallelLoop& loop);

  /// A volume that may have something to do in this scan.
  struct Prospect {
    VolumeKey key;
    bool near_surface = false;  ///< else only to be carved
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
  std::vector<ScannedVolume> scanned_;  ///< and for each of them:
  std::vector<ProjectionTask> tasks_;
};

}  // namespace hm
