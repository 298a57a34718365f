#pragma once
#include "hm/geometry/se3.hpp"

namespace hm {

/// Normal equations of a pose for a perturbation in the camera's own frame: T <- T exp(step), where step =
/// [translation; rotation] minimises step^T information step / 2 + gradient^T step.
struct PoseEquations {
  Mat6 information = Mat6::Zero();
  Vec6 gradient = Vec6::Zero();
  double cost = 0;  ///< sum of the robust costs
  int terms = 0;    ///< number of residuals within the gate

  PoseEquations& operator+=(const PoseEquations& other) {
    information += other.information;
    gradient += other.gradient;
    cost += other.cost;
    terms += other.terms;
    return *this;
  }
};

/// Adjoint of a transform, which converts a right perturbation to a left one: T exp(x) = exp(adjoint(T) x) T.
inline Mat6 adjoint(const SE3& T) {
  Mat6 out = Mat6::Zero();
  out.topLeftCorner<3, 3>() = T.rotation();
  out.bottomRightCorner<3, 3>() = T.rotation();
  out.topRightCorner<3, 3>() = skew(T.translation()) * T.rotation();
  return out;
}

/// Covariance of adjoint(T) x, where x has this one: that of a perturbation on the right of T, as one on the
/// left. With the inverse of T the other way round.
inline Mat6 covariance_by_adjoint(const Mat6& covariance, const SE3& T) {
  const Mat6 by = adjoint(T);
  return by * covariance * by.transpose();
}

}  // namespace hm
