#pragma once
#include <Eigen/Core>

#include "hm/geometry/pose_graph_3d.hpp"

namespace ceres {
class Manifold;
}

namespace hm::detail {

/// A pose as a solver keeps it: translation, quaternion x y z w.
using PoseState = Eigen::Matrix<double, 7, 1>;

PoseState pose_state(const SE3& T);
SE3 pose_of(const double* state);
/// A manifold of such states whose tangent is the move [dt; dw] (moved_by). Cost functions give derivatives
/// by moves: see write_by_move(). The caller owns it.
ceres::Manifold* new_pose_manifold();
/// Writes derivatives by a move as Ceres wants them, by the seven numbers of a state: rows of seven, the last
/// zero. The manifold's own derivative is the identity above a row of zeros, so that the product is right.
template <int kRows>
void write_by_move(const Eigen::Matrix<double, kRows, 6>& by_move, double* by_state) {
  Eigen::Map<Eigen::Matrix<double, kRows, 7, Eigen::RowMajor>> rows(by_state);
  rows.template leftCols<6>() = by_move;
  rows.col(6).setZero();
}
/// The inverse of the left Jacobian of SO(3) at -w, which is that of the right one at w (Barfoot 2017, 7.76).
Mat3 right_jacobian_inverse(const Vec3& rotation_vector);

}  // namespace hm::detail
