#pragma once
#include "hm/tsdf/alignment/dense_alignment.hpp"

namespace hm {

/// Aligns the poses of a trajectory sequentially to the map built from them (dissertation 4.2.8). Odometry
/// drifts, but its frame-to-frame motion is accurate: a pose is predicted from the last aligned one by
/// odometry's motion, with the parameters' prior_*_sigma, and corrected with the depth image; the correction
/// applies to all following poses.
///
/// The map drifts too, since errors common to all depth images accumulate in it. If odometry provides a
/// covariance, its pose is therefore used as a second prior, with standard deviations multiplied by
/// odometry_sigmas_ratio: it bounds the correction and lets it decay where the depth images no longer support
/// it. Not thread safe; bit-identical on every instruction set.
class TrajectoryAligner {
 public:
  /// `camera` must have no lens distortion; `tsdf` must be the parameters of the maps.
  TrajectoryAligner(const AlignmentParams& params, const TsdfParams& tsdf, const DepthNoise& noise,
                    const PinholeCamera& camera);

  /// Aligns the next frame, before it is integrated. `covariance`: of T_odom_camera relative to the origin of
  /// `odom`, as in TrackedFrame::covariance ([translation; rotation] of a left perturbation); zero: unknown.
  /// The result's T_world_camera is in the map frame and equals T_map_odom() * T_odom_camera; if the
  /// alignment is not accepted, it is the prediction.
  AlignmentResult align(const VolumeGrid& map, const DepthImage& depth, const SE3& T_odom_camera,
                        const Mat6& covariance = Mat6::Zero());

  /// Estimated pose of `odom` in the map; initially identity.
  [[nodiscard]] const SE3& T_map_odom() const { return T_map_odom_; }
  /// Sets the pose of `odom` in the map: when continuing a saved map, after a loop closure, or when a new
  /// submap of odometry has been placed in the map. Also resets the reference of odometry's own prior.
  void set_T_map_odom(const SE3& T_map_odom) { T_map_odom_ = T_map_odometry_ = T_map_odom; }

 private:
  [[nodiscard]] AlignmentPrior prior_of(const SE3& T_odom_camera, const Mat6& covariance) const;
  /// Prior from odometry's own pose and covariance, in the map.
  [[nodiscard]] AlignmentPrior odometry_prior(const SE3& T_odom_camera, const Mat6& covariance) const;

  AlignmentParams params_;
  DenseAligner aligner_;
  SE3 T_map_odom_;
  SE3 T_map_odometry_;  ///< reference of odometry's own prior
};

}  // namespace hm
