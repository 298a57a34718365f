#pragma once
#include <span>
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/odometry/registration/patch_alignment.hpp"
#include "hm/odometry/registration/pose_equations.hpp"

namespace hm {

/// A landmark found in the frame whose pose is wanted.
struct PointObservation {
  Vec3 p_odom = Vec3::Zero();
  Mat3 covariance = Mat3::Zero();  ///< of p_odom, m^2
  Vec2 pixel = Vec2::Zero();
  Mat2 pixel_covariance = Mat2::Identity();
  double depth_m = 0;  ///< read at the pixel; 0 for none
  double depth_variance_m2 = 0;
};

/// The residual of an observation, its information (sensor and landmark together) and its derivative by the
/// perturbation of the pose: pixel x, y and depth (without depth its row is zero).
struct PointResidual {
  Vec3 value = Vec3::Zero();
  Mat3 information = Mat3::Zero();
  Eigen::Matrix<double, 3, 6> by_pose = Eigen::Matrix<double, 3, 6>::Zero();
  Mat3 by_point = Mat3::Zero();  ///< by p_odom
  double squared_mahalanobis = 0;
};

/// Nothing when the point is not in front of the camera.
std::optional<PointResidual> point_residual(const PointObservation& observation, const SE3& T_odom_camera,
                                            const PinholeCamera& camera);

/// The robust weight of a squared Mahalanobis distance and its cost: Cauchy, scale `kRobustSigmas`.
inline constexpr double kRobustSigmas = 2.5;
double robust_weight(double squared_mahalanobis);
double robust_cost(double squared_mahalanobis);

/// Residuals beyond count as outliers: chi^2 of 3 degrees of freedom at 99.9 %.
inline constexpr double kOutlierSquaredMahalanobis = 16.27;

/// The normal equations of the camera's pose from the observations (perturbation in the camera's frame), with
/// all their covariances times `variance_scale`.
PoseEquations point_equations(std::span<const PointObservation> observations, const SE3& T_odom_camera,
                              const PinholeCamera& camera, double variance_scale = 1);

/// The square of a residual against the median of what its covariance lets expect.
double variance_ratio(const PointResidual& residual, const PointObservation& observation);

/// How much larger than their covariances say the squares of the residuals are, from their median; below 1
/// when smaller. 1 without observations.
double residual_variance_scale(std::span<const PointObservation> observations, const SE3& T_odom_camera,
                               const PinholeCamera& camera);

}  // namespace hm
