#pragma once
#include <Eigen/Core>

#include "hm/geometry/pose_graph_3d.hpp"

namespace ceres {
class Manifold;
}

namespace hm::detail {

/// Pose as a parameter block: translation, quaternion x y z w.
using PoseState = Eigen::Matrix<double, 7, 1>;

PoseState pose_state(const SE3& T);
SE3 pose_of(const double* state);
/// Creates a manifold of such states, whose tangent is the perturbation [dt; dw] (moved_by). Cost functions
/// provide derivatives with respect to it: see write_by_move(). Owned by the caller.
ceres::Manifold* new_pose_manifold();
/// Writes derivatives with respect to a perturbation as Ceres expects them, for the seven numbers of a state:
/// rows of seven, the last zero. The manifold's own Jacobian is the identity above a row of zeros, so that
/// the product is correct.
template <int kRows>
void write_by_move(const Eigen::Matrix<double, kRows, 6>& by_move, double* by_state) {
  Eigen::Map<Eigen::Matrix<double, kRows, 7, Eigen::RowMajor>> rows(by_state);
  rows.template leftCols<6>() = by_move;
  rows.col(6).setZero();
}
/// Inverse right Jacobian of SO(3) at w, which is the inverse left Jacobian at -w (Barfoot 2017, 7.76).
Mat3 right_jacobian_inverse(const Vec3& rotation_vector);

}  // namespace hm::detail
