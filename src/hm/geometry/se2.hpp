#pragma once
#include <Eigen/Core>

#include "hm/geometry/se3.hpp"

namespace hm {

using Mat2 = Eigen::Matrix2d;

/// Wraps an angle (radians, finite) to (-pi, pi].
double wrap_angle(double angle_rad);

/// Rigid transform of the plane: p_a = T_a_b * p_b. Metres and radians; the angle is kept in (-pi, pi].
class SE2 {
 public:
  SE2() = default;
  SE2(const Vec2& translation, double angle_rad);
  SE2(double x_m, double y_m, double angle_rad) : SE2(Vec2(x_m, y_m), angle_rad) {}
  /// Exponential of a twist [x; y; angle] (metres, radians).
  static SE2 exp(const Vec3& twist);
  [[nodiscard]] Vec3 log() const;
  /// Planar part of a 3D transform: x, y and yaw (of R = Rz(yaw) Ry(pitch) Rx(roll)).
  static SE2 from_se3(const SE3& motion);

  [[nodiscard]] const Vec2& translation() const { return translation_; }
  [[nodiscard]] double x() const { return translation_.x(); }
  [[nodiscard]] double y() const { return translation_.y(); }
  [[nodiscard]] double angle() const { return angle_; }
  [[nodiscard]] double cosine() const { return cosine_; }
  [[nodiscard]] double sine() const { return sine_; }
  /// (x, y, angle), the order used in all planar covariances.
  [[nodiscard]] Vec3 vector() const { return {translation_.x(), translation_.y(), angle_}; }
  [[nodiscard]] Mat2 rotation() const;
  [[nodiscard]] SE2 inverse() const;
  /// The same transform in 3D, at height z_m and without roll and pitch.
  [[nodiscard]] SE3 to_se3(double z_m = 0) const;

  SE2 operator*(const SE2& other) const;
  Vec2 operator*(const Vec2& point) const {
    return {cosine_ * point.x() - sine_ * point.y() + translation_.x(),
            sine_ * point.x() + cosine_ * point.y() + translation_.y()};
  }

 private:
  Vec2 translation_ = Vec2::Zero();
  double angle_ = 0, cosine_ = 1, sine_ = 0;
};

/// Roll, pitch, yaw of R = Rz(yaw) Ry(pitch) Rx(roll), radians; pitch in [-pi/2, pi/2].
Vec3 roll_pitch_yaw(const Mat3& rotation);
/// Rotation Rz(yaw) Ry(pitch) Rx(roll).
Mat3 rotation_from_roll_pitch_yaw(const Vec3& roll_pitch_yaw_rad);

}  // namespace hm
