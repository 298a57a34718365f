#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "hm/core/result.hpp"

namespace hm {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Mat4 = Eigen::Matrix4d;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

/// The cross-product matrix: skew(a) * b = a x b.
Mat3 skew(const Vec3& a);

/// A rotation from its rotation vector (axis times angle, radians), and back (angle in [0, pi]).
Mat3 so3_exp(const Vec3& rotation_vector);
Vec3 so3_log(const Mat3& rotation);

/// A rigid motion in 3D: p_a = T_a_b * p_b. Metres.
class SE3 {
 public:
  SE3() = default;
  SE3(const Mat3& rotation, const Vec3& translation) : rotation_(rotation), translation_(translation) {}
  SE3(const Eigen::Quaterniond& q, const Vec3& translation)
      : rotation_(q.normalized().toRotationMatrix()), translation_(translation) {}

  /// A 4x4 matrix as a rigid motion, made exactly orthonormal. An error when it is not finite, its last
  /// row is not 0 0 0 1, or its rotation differs from orthonormal by more than `tolerance` (largest
  /// element of R^T R - I) or mirrors.
  static Result<SE3> from_matrix(const Mat4& matrix, double tolerance = 1e-2);
  /// The exponential of a twist [translation part; rotation part] (Barfoot 2017, 7.1.3).
  static SE3 exp(const Vec6& twist);
  [[nodiscard]] Vec6 log() const;

  [[nodiscard]] const Mat3& rotation() const { return rotation_; }
  [[nodiscard]] const Vec3& translation() const { return translation_; }
  [[nodiscard]] Eigen::Quaterniond quaternion() const { return Eigen::Quaterniond(rotation_).normalized(); }
  [[nodiscard]] Mat4 matrix() const;
  [[nodiscard]] SE3 inverse() const;
  /// The rotation angle in radians, 0 to pi.
  [[nodiscard]] double angle() const { return so3_log(rotation_).norm(); }

  SE3 operator*(const SE3& other) const {
    return {rotation_ * other.rotation_, rotation_ * other.translation_ + translation_};
  }
  Vec3 operator*(const Vec3& point) const { return rotation_ * point + translation_; }

 private:
  Mat3 rotation_ = Mat3::Identity();
  Vec3 translation_ = Vec3::Zero();
};

/// The motion a fraction (0..1) of the way from a to b: slerp of rotation, line of translation.
SE3 interpolate(const SE3& a, const SE3& b, double fraction);

/// True when every number is finite and the rotation is orthonormal within 1e-6 and does not mirror.
bool is_rigid(const SE3& motion);

}  // namespace hm
