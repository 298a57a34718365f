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

/// Cross-product matrix: skew(a) * b = a x b.
Mat3 skew(const Vec3& a);

/// Rotation matrix of a rotation vector (axis times angle, radians), and the inverse (angle in [0, pi]).
Mat3 so3_exp(const Vec3& rotation_vector);
Vec3 so3_log(const Mat3& rotation);

/// Rigid transform in 3D: p_a = T_a_b * p_b. Metres.
class SE3 {
 public:
  SE3() = default;
  SE3(const Mat3& rotation, const Vec3& translation) : rotation_(rotation), translation_(translation) {}
  SE3(const Eigen::Quaterniond& q, const Vec3& translation)
      : rotation_(q.normalized().toRotationMatrix()), translation_(translation) {}

  /// Converts a 4x4 matrix, with the rotation made exactly orthonormal. Error when the matrix is not finite,
  /// its last row is not 0 0 0 1, or its rotation is a reflection or differs from orthonormal by more than
  /// `tolerance` (largest element of R^T R - I).
  static Result<SE3> from_matrix(const Mat4& matrix, double tolerance = 1e-2);
  /// Exponential of a twist [translation part; rotation part], metres and radians (Barfoot 2017, 7.1.3).
  static SE3 exp(const Vec6& twist);
  [[nodiscard]] Vec6 log() const;

  [[nodiscard]] const Mat3& rotation() const { return rotation_; }
  [[nodiscard]] const Vec3& translation() const { return translation_; }
  [[nodiscard]] Eigen::Quaterniond quaternion() const { return Eigen::Quaterniond(rotation_).normalized(); }
  [[nodiscard]] Mat4 matrix() const;
  [[nodiscard]] SE3 inverse() const;
  /// Rotation angle in radians, 0 to pi.
  [[nodiscard]] double angle() const { return so3_log(rotation_).norm(); }

  SE3 operator*(const SE3& other) const {
    return {rotation_ * other.rotation_, rotation_ * other.translation_ + translation_};
  }
  Vec3 operator*(const Vec3& point) const { return rotation_ * point + translation_; }

 private:
  Mat3 rotation_ = Mat3::Identity();
  Vec3 translation_ = Vec3::Zero();
};

/// Transform at a fraction (0..1) between a and b: slerp of the rotations, linear in the translations.
SE3 interpolate(const SE3& a, const SE3& b, double fraction);

/// True when all numbers are finite and the rotation is proper and orthonormal within 1e-6.
bool is_rigid(const SE3& motion);

}  // namespace hm
