#pragma once
#include <span>
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/odometry/registration/patch_alignment.hpp"
#include "hm/odometry/registration/pose_equations.hpp"

namespace hm {

/// Observation of a landmark in the frame to be registered.
struct PointObservation {
  Vec3 p_odom = Vec3::Zero();
  Mat3 covariance = Mat3::Zero();  ///< of p_odom, m^2
  Vec2 pixel = Vec2::Zero();
  Mat2 pixel_covariance = Mat2::Identity();
  double depth_m = 0;  ///< reading at the pixel; 0: none
  double depth_variance_m2 = 0;
  /// Motion of the point relative to the pixel per motion of the camera; not 1 if the pixel's time differs
  /// from the pose's, since the velocity in between follows from the pose.
  double pose_gain = 1;

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(p_odom, covariance, pixel, pixel_covariance, depth_m, depth_variance_m2, pose_gain);
  }
};

/// Residual of an observation (pixel x, y and depth; without depth its row is zero), its information (of
/// sensor and landmark) and its derivative with respect to the pose perturbation.
struct PointResidual {
  Vec3 value = Vec3::Zero();
  Mat3 information = Mat3::Zero();
  Eigen::Matrix<double, 3, 6> by_pose = Eigen::Matrix<double, 3, 6>::Zero();
  Mat3 by_point = Mat3::Zero();  ///< by p_odom
  double squared_mahalanobis = 0;
};

/// Computes the residual; nothing when the point is not in front of the camera.
std::optional<PointResidual> point_residual(const PointObservation& observation, const SE3& T_odom_camera,
                                            const PinholeCamera& camera);

/// Cauchy weight and cost of a squared Mahalanobis distance, scale `kRobustSigmas`.
inline constexpr double kRobustSigmas = 2.5;
double robust_weight(double squared_mahalanobis);
double robust_cost(double squared_mahalanobis);

/// Outlier threshold: chi^2 with 3 degrees of freedom at 99.9 %.
inline constexpr double kOutlierSquaredMahalanobis = 16.27;

/// Normal equations of the camera's pose from the observations (perturbation in the camera's frame), with all
/// covariances scaled by `variance_scale`.
PoseEquations point_equations(std::span<const PointObservation> observations, const SE3& T_odom_camera,
                              const PinholeCamera& camera, double variance_scale = 1);

/// Squared residual relative to the expected median for its covariance.
double variance_ratio(const PointResidual& residual, const PointObservation& observation);

/// Ratio of the squared residuals to their covariances, estimated from the median; 1 without observations.
double residual_variance_scale(std::span<const PointObservation> observations, const SE3& T_odom_camera,
                               const PinholeCamera& camera);

}  // namespace hm
