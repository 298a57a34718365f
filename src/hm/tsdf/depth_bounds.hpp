#pragma once
#include "hm/geometry/camera.hpp"
#include "hm/tsdf/projection_scan.hpp"

namespace hm {

/// Bounds on what a depth image shows where a volume falls on it: from tile extremes, so that whole
/// volumes and slices can be passed over without looking at a pixel. Always on the safe side.
class DepthBounds {
 public:
  DepthBounds(const PreparedDepth& depth, const PinholeCamera& camera, const SE3& T_camera_world,
              const TsdfParams& params, const TruncationModel& truncation);

  /// Camera depths between which voxels of the volume may be in the hit region; empty (near > far) when
  /// none can. Metres.
  struct Band {
    float near_m = 0, far_m = -1;
    bool open = false;  ///< some of the tiles see only beyond far: rays pass by
    [[nodiscard]] bool empty() const { return near_m > far_m; }
  };
  [[nodiscard]] Band band_of(VolumeKey key) const;

  /// True when rays may pass beyond the near side of the volume: there may be something to carve.
  [[nodiscard]] bool may_be_seen_through(VolumeKey key) const;

 private:
  /// A volume's voxel centres in camera coordinates, and the tiles that they may fall on.
  struct Footprint {
    float near_m = 0, far_m = 0;  ///< of voxel centres
    int x0 = 0, x1 = -1, y0 = 0, y1 = -1;
  };
  [[nodiscard]] Footprint footprint_of(VolumeKey key) const;

  const PreparedDepth& depth_;
  TruncationModel truncation_;
  float margin_m_ = 0;
  Eigen::Matrix3f rotation_;      ///< world to camera, times the volume's size
  Eigen::Vector3f translation_;   ///< of volume 0 0 0's centre
  Eigen::Vector3f half_;          ///< half extents of the voxel centres along the camera's axes, metres
  float fx_, fy_, cx_, cy_;
};

}  // namespace hm
