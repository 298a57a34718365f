#pragma once
#include "hm/tsdf/alignment/dense_alignment.hpp"

namespace hm {

/// Aligns the poses of a trajectory one after the other to the map that grows of them (dissertation 4.2.8).
/// Odometry drifts, but its frame-to-frame motion is accurate. So a pose is predicted to be where
/// the last aligned one was, moved as odometry has it, with the parameters' prior_*_sigma, and the depth
/// picture corrects that; the correction stays with all poses that follow.
///
/// The map drifts too: it grows of the poses aligned to it, and what errs in every picture alike adds up
/// frame by frame. Odometry that tells how far off its pose may be is therefore believed as a second witness,
/// odometry_sigmas_ratio times as uncertain as it says: the correction cannot wander farther than that, and
/// fades where the depth pictures no longer ask for it. Not thread safe; the same bits on every instruction
/// set.
class TrajectoryAligner {
 public:
  /// `camera` must have no lens distortion; `tsdf` must be what the maps are made with.
  TrajectoryAligner(const AlignmentParams& params, const TsdfParams& tsdf, const DepthNoise& noise,
                    const PinholeCamera& camera);

  /// The next frame, before it is integrated. `covariance`: of T_odom_camera against where `odom` began, as
  /// TrackedFrame::covariance is ([translation; rotation] of a left perturbation); zero: not known. The
  /// answer's T_world_camera is in the map: found, or, when it is not accepted, the best guess without the
  /// picture. In any case T_map_odom() * T_odom_camera.
  AlignmentResult align(const VolumeGrid& map, const DepthImage& depth, const SE3& T_odom_camera,
                        const Mat6& covariance = Mat6::Zero());

  /// Where alignment has found `odom` to be: identity at first.
  [[nodiscard]] const SE3& T_map_odom() const { return T_map_odom_; }
  /// For going on with a saved map, and after somebody else has moved things: a loop was closed, or odometry
  /// began another submap whose place in the map is now known. Odometry's own poses are from now on believed
  /// to be there.
  void set_T_map_odom(const SE3& T_map_odom) { T_map_odom_ = T_map_believed_ = T_map_odom; }

 private:
  [[nodiscard]] AlignmentPrior prior_of(const SE3& T_odom_camera, const Mat6& covariance) const;
  /// What odometry says of its pose, in the map.
  [[nodiscard]] AlignmentPrior witness(const SE3& T_odom_camera, const Mat6& covariance) const;

  AlignmentParams params_;
  DenseAligner aligner_;
  SE3 T_map_odom_;
  SE3 T_map_believed_;  ///< `odom` as far as odometry is concerned
};

}  // namespace hm
