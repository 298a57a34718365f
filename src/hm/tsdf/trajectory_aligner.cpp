#include "hm/tsdf/trajectory_aligner.hpp"

namespace hm {

TrajectoryAligner::TrajectoryAligner(const AlignmentParams& params, const TsdfParams& tsdf,
                                     const DepthNoise& noise, const PinholeCamera& camera)
    : params_(params), aligner_(params, tsdf, noise, camera) {}

AlignmentResult TrajectoryAligner::align(const VolumeGrid& map, const DepthImage& depth,
                                         const SE3& T_odom_camera) {
  AlignmentResult found =
      aligner_.align(map, depth, prior_of_given_pose(params_, T_map_odom_ * T_odom_camera));
  if (found.status == AlignmentStatus::kAccepted)
    T_map_odom_ = found.T_world_camera * T_odom_camera.inverse();
  return found;
}

}  // namespace hm
