#pragma once
#include <optional>
#include <span>

#include "hm/geometry/se3.hpp"

namespace hm {

/// One point measured in two frames (metres), with covariances in those frames (m^2).
struct PointPair {
  Vec3 p_a = Vec3::Zero();
  Vec3 p_b = Vec3::Zero();
  Mat3 covariance_a = Mat3::Zero();
  Mat3 covariance_b = Mat3::Zero();

  /// Residual p_a - T_a_b * p_b.
  [[nodiscard]] Vec3 residual(const SE3& T_a_b) const { return p_a - T_a_b * p_b; }
  /// Covariance of the residual, in frame a.
  [[nodiscard]] Mat3 residual_covariance(const SE3& T_a_b) const {
    return covariance_a + T_a_b.rotation() * covariance_b * T_a_b.rotation().transpose();
  }
};

/// Rigid transform T_a_b that minimises the sum of weight |p_a - T_a_b p_b|^2, in closed form (Arun, Huang
/// and Blostein 1987; never a reflection: Umeyama 1991). `weights` is empty (all equal) or has one
/// non-negative weight per pair. Nothing when the rotation is undetermined: fewer than three pairs, or
/// collinear points.
std::optional<SE3> register_points(std::span<const PointPair> pairs, std::span<const double> weights = {});

/// Transform estimated from pairs with their covariances.
struct RefinedMotion {
  SE3 T_a_b;
  Mat6 covariance = Mat6::Zero();  ///< [translation; rotation] of a left perturbation exp(xi) T_a_b, frame a
  double mean_chi2 =
      0;  ///< mean squared Mahalanobis distance of a pair (expected: 3), without robust weights
};

/// Refines a transform by Gauss-Newton on the Mahalanobis distances of the residuals, from a start near the
/// solution, with Cauchy weights (`cauchy_sigma` in standard deviations; 0: not robust). The sum of a pair's
/// covariances must be invertible. Nothing when the pairs do not determine all six degrees of freedom.
std::optional<RefinedMotion> refine_registration(std::span<const PointPair> pairs, const SE3& start_T_a_b,
                                                 double cauchy_sigma = 3.0);

/// Covariance of a transform near the solution: the inverse of the pairs' information (see RefinedMotion).
/// Nothing when the pairs do not determine it, or covariances are missing.
std::optional<Mat6> registration_covariance(std::span<const PointPair> pairs, const SE3& T_a_b);

namespace detail {
/// Derivative of a residual with respect to a left perturbation [translation; rotation] of T_a_b; for tests.
Eigen::Matrix<double, 3, 6> residual_jacobian(const PointPair& pair, const SE3& T_a_b);
}  // namespace detail

}  // namespace hm
