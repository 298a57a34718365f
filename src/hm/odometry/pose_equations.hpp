#pragma once
#include "hm/geometry/se3.hpp"

namespace hm {

/// The normal equations of a pose, of a perturbation in the camera's own frame: T <- T exp(step), step =
/// [translation; rotation] minimises step^T information step / 2 + gradient^T step.
struct PoseEquations {
  Mat6 information = Mat6::Zero();
  Vec6 gradient = Vec6::Zero();
  double cost = 0;  ///< sum of the robust costs
  int terms = 0;    ///< residuals that were not gated out

  PoseEquations& operator+=(const PoseEquations& other) {
    information += other.information;
    gradient += other.gradient;
    cost += other.cost;
    terms += other.terms;
    return *this;
  }
};

}  // namespace hm
