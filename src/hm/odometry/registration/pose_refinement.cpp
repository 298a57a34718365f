#include "hm/odometry/registration/pose_refinement.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "hm/core/statistics.hpp"

namespace hm {
std::optional<PointResidual> point_residual(const PointObservation& observation, const SE3& T_odom_camera,
                                            const PinholeCamera& camera) {
  const Mat3 R_camera_odom = T_odom_camera.rotation().transpose();
  const Vec3 p = R_camera_odom * (observation.p_odom - T_odom_camera.translation());
  if (!(p.z() > 0.05)) return std::nullopt;
  PointResidual out;
  const Vec2 seen(camera.fx * p.x() / p.z() + camera.cx, camera.fy * p.y() / p.z() + camera.cy);
  out.value.head<2>() = seen - observation.pixel;
  Mat3 by_camera_point;
  by_camera_point << camera.fx / p.z(), 0, -camera.fx * p.x() / (p.z() * p.z()),  //
      0, camera.fy / p.z(), -camera.fy * p.y() / (p.z() * p.z()),                 //
      0, 0, 1;
  const bool has_depth = observation.depth_m > 0;
  if (has_depth)
    out.value.z() = p.z() - observation.depth_m;
  else
    by_camera_point.row(2).setZero();
  // T <- T exp(step): the point moves by -translation - rotation x p in the camera.
  out.by_pose.leftCols<3>() = -by_camera_point;
  out.by_pose.rightCols<3>() = by_camera_point * skew(p);
  if (observation.pose_gain != 1) out.by_pose.topRows<2>() *= observation.pose_gain;
  out.by_point = by_camera_point * R_camera_odom;
  Mat3 covariance = out.by_point * observation.covariance * out.by_point.transpose();
  covariance.topLeftCorner<2, 2>() += observation.pixel_covariance;
  if (has_depth) {
    covariance(2, 2) += observation.depth_variance_m2;
    out.information = covariance.inverse();
  } else {
    out.information.topLeftCorner<2, 2>() = covariance.topLeftCorner<2, 2>().inverse();
  }
  out.squared_mahalanobis = out.value.dot(out.information * out.value);
  return out;
}

double robust_weight(double squared_mahalanobis) {
  return 1 / (1 + squared_mahalanobis / (kRobustSigmas * kRobustSigmas));
}

double variance_ratio(const PointResidual& residual, const PointObservation& observation) {
  return residual.squared_mahalanobis / (observation.depth_m > 0 ? kMedianChi2Of3 : kMedianChi2Of2);
}

double robust_cost(double squared_mahalanobis) {
  return 0.5 * kRobustSigmas * kRobustSigmas *
         std::log1p(squared_mahalanobis / (kRobustSigmas * kRobustSigmas));
}

PoseEquations point_equations(std::span<const PointObservation> observations, const SE3& T_odom_camera,
                              const PinholeCamera& camera, double variance_scale) {
  PoseEquations equations;
  for (const PointObservation& observation : observations) {
    const auto residual = point_residual(observation, T_odom_camera, camera);
    if (!residual) continue;
    const double squared = residual->squared_mahalanobis / variance_scale;
    const double weight = robust_weight(squared) / variance_scale;
    const Eigen::Matrix<double, 6, 3> weighted =
        residual->by_pose.transpose() * (weight * residual->information);
    equations.information.noalias() += weighted * residual->by_pose;
    equations.gradient.noalias() += weighted * residual->value;
    equations.cost += robust_cost(squared);
    ++equations.terms;
  }
  return equations;
}

double residual_variance_scale(std::span<const PointObservation> observations, const SE3& T_odom_camera,
                               const PinholeCamera& camera) {
  std::vector<double> ratios;
  for (const PointObservation& observation : observations) {
    const auto residual = point_residual(observation, T_odom_camera, camera);
    if (!residual) continue;
    ratios.push_back(variance_ratio(*residual, observation));
  }
  return ratios.empty() ? 1 : middle_value(std::span(ratios));
}

}  // namespace hm
