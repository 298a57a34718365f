// hm: compiled alone (Eigen's decompositions).
#include "hm/geometry/planar_covariance.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "hm/core/check.hpp"

namespace hm {

Mat3 compose_covariance(const SE2& T_a_b, const Mat3& covariance_a_b, const SE2& T_b_c,
                        const Mat3& covariance_b_c) {
  Mat3 first = Mat3::Identity();
  const Vec2 lever = T_a_b.rotation() * T_b_c.translation();
  first(0, 2) = -lever.y();
  first(1, 2) = lever.x();
  return first * covariance_a_b * first.transpose() + turned_covariance(T_a_b.rotation(), covariance_b_c);
}

Mat3 turned_covariance(const Mat2& R_a_b, const Mat3& covariance_b) {
  Mat3 turn = Mat3::Identity();
  turn.topLeftCorner<2, 2>() = R_a_b;
  return turn * covariance_b * turn.transpose();
}

/// By the eigenvalues of `a` in units of `b`, as an inverse of `a` would lose the digits of its small ones.
Mat3 fused_covariance(const Mat3& a, const Mat3& b) {
  const Eigen::LLT<Mat3> factor(b);
  HM_CHECK(factor.info() == Eigen::Success, "a covariance that is not positive definite");
  const Mat3 unit = factor.matrixL();
  const Mat3 inverse = unit.triangularView<Eigen::Lower>().solve(Mat3::Identity());
  const Eigen::SelfAdjointEigenSolver<Mat3> in_units(inverse * a * inverse.transpose());
  const Vec3 values = in_units.eigenvalues().cwiseMax(0);
  const Mat3 axes = unit * in_units.eigenvectors();
  return axes * (values.array() / (values.array() + 1)).matrix().asDiagonal() * axes.transpose();
}

}  // namespace hm
