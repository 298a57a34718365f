#pragma once
#include <optional>
#include <span>

#include "hm/geometry/se3.hpp"

namespace hm {

/// The same point of the world measured in two frames, with covariances in those frames (m^2).
struct PointPair {
  Vec3 p_a = Vec3::Zero();
  Vec3 p_b = Vec3::Zero();
  Mat3 covariance_a = Mat3::Zero();
  Mat3 covariance_b = Mat3::Zero();

  /// p_a - T_a_b * p_b.
  [[nodiscard]] Vec3 residual(const SE3& T_a_b) const { return p_a - T_a_b * p_b; }
  /// Of the residual, in frame a.
  [[nodiscard]] Mat3 residual_covariance(const SE3& T_a_b) const {
    return covariance_a + T_a_b.rotation() * covariance_b * T_a_b.rotation().transpose();
  }
};

/// The rigid motion T_a_b with the least sum of weight |p_a - T_a_b p_b|^2, in closed form (Arun, Huang and
/// Blostein 1987; never a mirror: Umeyama 1991). `weights` is empty (all equal) or one a pair, not negative.
/// Nothing when the rotation is not determined: fewer than three pairs, or all points on a line.
std::optional<SE3> register_points(std::span<const PointPair> pairs, std::span<const double> weights = {});

/// A motion that explains pairs by their covariances.
struct RefinedMotion {
  SE3 T_a_b;
  Mat6 covariance = Mat6::Zero();  ///< [translation; rotation] of a left perturbation exp(xi) T_a_b, frame a
  double mean_chi2 = 0;  ///< squared Mahalanobis distance of a pair, 3 expected; without robust weights
};

/// Gauss-Newton on the Mahalanobis distances of the residuals from a start close to the answer, each pair
/// weighted after Cauchy (`cauchy_sigma` in standard deviations; 0: not robust). Pairs need covariances whose
/// sum is regular. Nothing when the pairs do not determine all six degrees of freedom.
std::optional<RefinedMotion> refine_registration(std::span<const PointPair> pairs, const SE3& start_T_a_b,
                                                 double cauchy_sigma = 3.0);

/// How well pairs determine a motion close to the one that fits them: the inverse of their information (see
/// RefinedMotion). Nothing where they do not determine it, or where covariances are missing.
std::optional<Mat6> registration_covariance(std::span<const PointPair> pairs, const SE3& T_a_b);

namespace detail {
/// The derivative of a residual by a left perturbation [translation; rotation] of T_a_b; for tests.
Eigen::Matrix<double, 3, 6> residual_jacobian(const PointPair& pair, const SE3& T_a_b);
}  // namespace detail

}  // namespace hm
