#pragma once
#include "hm/tsdf/dense_alignment.hpp"

namespace hm {

/// Aligns the poses of a trajectory one after the other to the map that grows of them (dissertation 4.2.8).
/// Odometry drifts: what it tells well is the motion between two frames. So a pose is believed to be where
/// the last aligned one was, moved as odometry says, with the parameters' prior_*_sigma, and the depth
/// picture corrects that; the correction stays with all poses that follow. Not thread safe; the same bits on
/// every instruction set.
class TrajectoryAligner {
 public:
  /// `camera` must have no lens distortion; `tsdf` must be what the maps are made with.
  TrajectoryAligner(const AlignmentParams& params, const TsdfParams& tsdf, const DepthNoise& noise,
                    const PinholeCamera& camera);

  /// The next frame, before it is integrated. The answer's T_world_camera is in the map: found, or, when it
  /// is not accepted, T_map_odom() * T_odom_camera.
  AlignmentResult align(const VolumeGrid& map, const DepthImage& depth, const SE3& T_odom_camera);

  /// Where alignment has found `odom` to be: identity at first.
  [[nodiscard]] const SE3& T_map_odom() const { return T_map_odom_; }
  /// For going on with a saved map, and after somebody else has moved things: a loop was closed, or odometry
  /// began another submap whose place in the map is now known.
  void set_T_map_odom(const SE3& T_map_odom) { T_map_odom_ = T_map_odom; }

 private:
  AlignmentParams params_;
  DenseAligner aligner_;
  SE3 T_map_odom_;
};

}  // namespace hm
