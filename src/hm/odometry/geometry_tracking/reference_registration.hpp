#pragma once
#include <span>

#include "hm/odometry/geometry_tracking/pose_velocity_filter.hpp"
#include "hm/odometry/registration/surface_alignment.hpp"

namespace hm {

/// Surface that a depth image is registered to.
struct ReferenceSurface {
  const SurfaceGrid* surface = nullptr;
  SE3 T_odom_depth;
  Mat6 covariance = Mat6::Zero();  ///< of its pose: left perturbation in odom
};

/// Pose of a depth image from several surfaces and a prediction.
struct ReferenceRegistration {
  SE3 T_odom_depth;
  /// Information of the surfaces alone, as if their poses were exact: perturbation in the camera's frame; 0
  /// in the directions that they do not hold.
  Mat6 information = Mat6::Zero();
  Mat6 reference_covariance = Mat6::Zero();  ///< of the surfaces' poses, in common: left perturbation in odom
  double compared_ratio = 0;                 ///< readings where one of the surfaces is
  double fitting_ratio = 0;                  ///< of these: on a surface, within the noise
};

/// How far readings may lie from the surfaces at the start (m): a few centimetres after a frame, more after a
/// gap.
enum class RegistrationReach { kNear, kFar };

/// Registers a depth image to surfaces: point-to-plane distances with narrowing gates and the prediction as a
/// prior, so that directions which the surfaces do not hold (a plane: three; a corridor: one) keep the
/// prediction. Every surface counts by the certainty of its own pose.
ReferenceRegistration register_to_references(std::span<const ReferenceSurface> references,
                                             const DepthGrid& current,
                                             const PoseVelocityFilter::Prediction& prediction,
                                             RegistrationReach reach, const DepthNoise& noise);

/// What the normals of a surface and those of another depth image of it say of the motion between them:
/// sums of J w J^T, perturbation in the current camera's frame. Errors of the normals of one image are
/// independent of those of the other, so that they add to the first sum, but not to the second.
struct NormalComparison {
  Mat6 by_one = Mat6::Zero();   ///< both J with the normals of the surface
  Mat6 by_both = Mat6::Zero();  ///< one J with those of the surface, one with those of the image
  std::size_t normals = 0;
};
NormalComparison compare_normals(const SurfaceGrid& surface, std::span<const SurfaceElement> current,
                                 const SE3& T_surface_current);

/// The part of the normal equations that holds: point-to-plane distances to a perfect plane seem to hold the
/// directions along it, too, since measured normals err. What both images' normals do not confirm, or what is
/// not clearly more than the noise of a Kinect, is taken away. `depth_m`: of the scene.
PoseEquations without_normal_noise(const PoseEquations& equations, const NormalComparison& normals,
                                   double depth_m);

}  // namespace hm
