#include "hm/odometry/registration/rigid_registration.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "hm/core/check.hpp"
#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {

namespace {

constexpr int kMaxSteps = 10;
constexpr double kRigidConverged = 1e-8;         ///< metres and radians
constexpr double kLeastSpreadRatio = 1e-6;       ///< second to first singular value of the points' moments
constexpr double kLeastInformationRatio = 1e-9;  ///< smallest to largest eigenvalue, metres against radians

struct Centroids {
  Vec3 a = Vec3::Zero();
  Vec3 b = Vec3::Zero();
  double weight = 0;
};

double weight_of(std::span<const double> weights, std::size_t i) {
  return weights.empty() ? 1.0 : weights[i];
}

Centroids centroids(std::span<const PointPair> pairs, std::span<const double> weights) {
  Centroids sum;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double w = weight_of(weights, i);
    sum.a += w * pairs[i].p_a;
    sum.b += w * pairs[i].p_b;
    sum.weight += w;
  }
  if (sum.weight > 0) {
    sum.a /= sum.weight;
    sum.b /= sum.weight;
  }
  return sum;
}

/// Normal equations of one Gauss-Newton step.
struct Equations {
  Mat6 information = Mat6::Zero();
  Vec6 gradient = Vec6::Zero();
  double chi2 = 0;
};

Equations build_equations(std::span<const PointPair> pairs, const SE3& T_a_b, double cauchy_sigma) {
  Equations sum;
  for (const PointPair& pair : pairs) {
    const Vec3 residual = pair.residual(T_a_b);
    const Mat3 weight = pair.residual_covariance(T_a_b).inverse();
    const double chi2 = residual.dot(weight * residual);
    const double robust = cauchy_sigma > 0 ? 1.0 / (1.0 + chi2 / (cauchy_sigma * cauchy_sigma)) : 1.0;
    const Eigen::Matrix<double, 3, 6> jacobian = detail::residual_jacobian(pair, T_a_b);
    const Eigen::Matrix<double, 6, 3> weighted = robust * jacobian.transpose() * weight;
    sum.information += weighted * jacobian;
    sum.gradient += weighted * residual;
    sum.chi2 += chi2;
  }
  return sum;
}

bool is_determined(const Mat6& information) {
  const Vec6 values = symmetric_eigenvalues(information);
  return values.allFinite() && values.minCoeff() > kLeastInformationRatio * values.maxCoeff();
}

Mat6 symmetric_inverse(const Mat6& information) {
  const Mat6 inverse = inverse_of(information);
  return 0.5 * (inverse + inverse.transpose());
}

}  // namespace

std::optional<SE3> register_points(std::span<const PointPair> pairs, std::span<const double> weights) {
  HM_CHECK(weights.empty() || weights.size() == pairs.size(), "{} weights, {} pairs", weights.size(),
           pairs.size());
  if (pairs.size() < 3) return std::nullopt;
  const Centroids mean = centroids(pairs, weights);
  Mat3 moments = Mat3::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    moments += weight_of(weights, i) * (pairs[i].p_a - mean.a) * (pairs[i].p_b - mean.b).transpose();
  }
  const Svd3 svd = svd_of(moments);
  const Vec3 spread = svd.values;
  if (!spread.allFinite() || spread(1) <= kLeastSpreadRatio * spread(0) || spread(0) <= 0)
    return std::nullopt;
  const bool mirrors = (svd.U * svd.V.transpose()).determinant() < 0;
  const Vec3 signs(1, 1, mirrors ? -1 : 1);
  const Mat3 rotation = svd.U * signs.asDiagonal() * svd.V.transpose();
  return SE3(rotation, mean.a - rotation * mean.b);
}

std::optional<RefinedMotion> refine_registration(std::span<const PointPair> pairs, const SE3& start_T_a_b,
                                                 double cauchy_sigma) {
  if (pairs.size() < 3) return std::nullopt;
  RefinedMotion motion{start_T_a_b, Mat6::Zero(), 0};
  for (int step = 0; step < kMaxSteps; ++step) {
    const Equations equations = build_equations(pairs, motion.T_a_b, cauchy_sigma);
    if (!is_determined(equations.information)) return std::nullopt;
    const Vec6 update = -solve_symmetric(equations.information, equations.gradient);
    motion.T_a_b = SE3::exp(update) * motion.T_a_b;
    if (update.norm() < kRigidConverged) break;
  }
  const Equations last = build_equations(pairs, motion.T_a_b, cauchy_sigma);
  if (!is_determined(last.information) || !is_rigid(motion.T_a_b)) return std::nullopt;
  motion.covariance = symmetric_inverse(last.information);
  motion.mean_chi2 = last.chi2 / static_cast<double>(pairs.size());
  return motion;
}

std::optional<Mat6> registration_covariance(std::span<const PointPair> pairs, const SE3& T_a_b) {
  if (pairs.size() < 3) return std::nullopt;
  const Equations equations = build_equations(pairs, T_a_b, 0);
  if (!equations.information.allFinite() || !is_determined(equations.information)) return std::nullopt;
  return symmetric_inverse(equations.information);
}

Eigen::Matrix<double, 3, 6> detail::residual_jacobian(const PointPair& pair, const SE3& T_a_b) {
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian.leftCols<3>() = -Mat3::Identity();
  jacobian.rightCols<3>() = skew(T_a_b * pair.p_b);
  return jacobian;
}

}  // namespace hm
