#include "hm/slam/pose_graph/pose_manifold.hpp"

#include <ceres/manifold.h>

#include <cmath>

namespace hm::detail {

PoseState pose_state(const SE3& T) {
  PoseState state;
  state << T.translation(), T.quaternion().coeffs();
  return state;
}

SE3 pose_of(const double* state) {
  return {Eigen::Quaterniond(state[6], state[3], state[4], state[5]), Vec3(state[0], state[1], state[2])};
}

namespace {

using ByMove = Eigen::Matrix<double, 7, 6, Eigen::RowMajor>;
using MoveBy = Eigen::Matrix<double, 6, 7, Eigen::RowMajor>;

class PoseManifold : public ceres::Manifold {
 public:
  [[nodiscard]] int AmbientSize() const override { return 7; }
  [[nodiscard]] int TangentSize() const override { return 6; }
  bool Plus(const double* state, const double* move, double* moved) const override {
    const Vec6 step = Eigen::Map<const Vec6>(move);
    Eigen::Map<PoseState>(moved, 7) = pose_state(moved_by(pose_of(state), step));
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<ByMove>(jacobian, 7, 6) = ByMove::Identity();
    return true;
  }
  bool Minus(const double* to, const double* from, double* move) const override {
    const SE3 between = pose_of(from).inverse() * pose_of(to);
    Eigen::Map<Vec3>(move, 3) = between.translation();
    Eigen::Map<Vec3>(move + 3, 3) = so3_log(between.rotation());
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<MoveBy>(jacobian, 6, 7) = MoveBy::Identity();
    return true;
  }
};

}  // namespace

ceres::Manifold* new_pose_manifold() { return new PoseManifold; }

Mat3 right_jacobian_inverse(const Vec3& rotation_vector) {
  const double angle = rotation_vector.norm();
  const Mat3 w = skew(rotation_vector);
  if (angle < 1e-4) return Mat3::Identity() + 0.5 * w + w * w / 12.0;
  const double factor = 1 / (angle * angle) - 1 / (2 * angle * std::tan(angle / 2));
  return Mat3::Identity() + 0.5 * w + factor * w * w;
}

}  // namespace hm::detail
