#include "hm/tsdf/alignment/trajectory_aligner.hpp"

#include "hm/geometry/solvers/small_solvers.hpp"
#include "hm/tsdf/alignment/alignment_step.hpp"

namespace hm {
namespace {

/// Lower limit of a pose's standard deviation per axis, metres and radians.
constexpr double kLeastSigma = 0.0005;

/// Fuses two independent pose priors to first order; the search starts at the first.
AlignmentPrior together(const AlignmentPrior& a, const AlignmentPrior& b) {
  const TurningCentre centre{b.T_world_camera.translation(), 1};
  const Mat6 to_origin = centre.to_origin();
  const Mat6 of_a = to_origin.transpose() * a.information * to_origin,
             of_b = to_origin.transpose() * b.information * to_origin;
  const Mat6 of_both = of_a + of_b;
  const Vec6 from_a = solve_symmetric(of_both, of_b * centre.between(a.T_world_camera, b.T_world_camera));
  return {centre.moved(a.T_world_camera, from_a), a.information + b.information, a.T_world_camera};
}

}  // namespace

TrajectoryAligner::TrajectoryAligner(const AlignmentParams& params, const TsdfParams& tsdf,
                                     const DepthNoise& noise, const PinholeCamera& camera)
    : params_(params), aligner_(params, tsdf, noise, camera) {}

AlignmentPrior TrajectoryAligner::odometry_prior(const SE3& T_odom_camera, const Mat6& covariance) const {
  // Perturbation about the camera, where position and orientation are decoupled; axes of the map.
  const Mat6 to_camera = TurningCentre{T_odom_camera.translation(), 1}.to_origin().inverse();
  Mat6 turned = Mat6::Zero();
  turned.topLeftCorner<3, 3>() = turned.bottomRightCorner<3, 3>() = T_map_odometry_.rotation();
  const Mat6 jacobian = params_.odometry_sigmas_ratio * turned * to_camera;
  Mat6 about_camera = jacobian * covariance * jacobian.transpose();
  about_camera.diagonal().array() += kLeastSigma * kLeastSigma;
  const SE3 T_map_camera = T_map_odometry_ * T_odom_camera;
  const Mat6 from_origin = TurningCentre{T_map_camera.translation(), 1}.to_origin().inverse();
  return {T_map_camera, from_origin.transpose() * about_camera.inverse() * from_origin, {}};
}

AlignmentPrior TrajectoryAligner::prior_of(const SE3& T_odom_camera, const Mat6& covariance) const {
  const AlignmentPrior moved = prior_of_given_pose(params_, T_map_odom_ * T_odom_camera);
  const bool is_known = covariance.allFinite() && !covariance.isZero(0);
  if (!is_known || params_.odometry_sigmas_ratio <= 0) return moved;
  return together(moved, odometry_prior(T_odom_camera, covariance));
}

AlignmentResult TrajectoryAligner::align(const VolumeGrid& map, const DepthImage& depth,
                                         const SE3& T_odom_camera, const Mat6& covariance) {
  const AlignmentPrior prior = prior_of(T_odom_camera, covariance);
  AlignmentResult found = aligner_.align(map, depth, prior);
  if (found.status == AlignmentStatus::kAccepted || prior.T_world_start)
    T_map_odom_ = found.T_world_camera * T_odom_camera.inverse();
  return found;
}

}  // namespace hm
