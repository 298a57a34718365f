#include "hm/geometry/se2.hpp"

#include <cmath>
#include <numbers>

namespace hm {

double wrap_angle(double angle_rad) {
  const double wrapped = std::remainder(angle_rad, 2.0 * std::numbers::pi);
  return wrapped <= -std::numbers::pi ? wrapped + 2.0 * std::numbers::pi : wrapped;
}

SE2::SE2(const Vec2& translation, double angle_rad)
    : translation_(translation),
      angle_(wrap_angle(angle_rad)),
      cosine_(std::cos(angle_rad)),
      sine_(std::sin(angle_rad)) {}

namespace {

/// sin(a)/a and (1 - cos(a))/a, by their series where the quotients lose digits.
Vec2 left_jacobian_terms(double angle) {
  if (std::abs(angle) < 1e-4) return {1.0 - angle * angle / 6.0, 0.5 * angle};
  return {std::sin(angle) / angle, (1.0 - std::cos(angle)) / angle};
}

}  // namespace

SE2 SE2::exp(const Vec3& twist) {
  const Vec2 terms = left_jacobian_terms(twist.z());
  return {terms.x() * twist.x() - terms.y() * twist.y(), terms.y() * twist.x() + terms.x() * twist.y(),
          twist.z()};
}

Vec3 SE2::log() const {
  const Vec2 terms = left_jacobian_terms(angle_);
  const double scale = 1.0 / terms.squaredNorm();
  return {scale * (terms.x() * x() + terms.y() * y()), scale * (terms.x() * y() - terms.y() * x()), angle_};
}

SE2 SE2::from_se3(const SE3& motion) {
  return {motion.translation().x(), motion.translation().y(), roll_pitch_yaw(motion.rotation()).z()};
}

Mat2 SE2::rotation() const {
  Mat2 matrix;
  matrix << cosine_, -sine_, sine_, cosine_;
  return matrix;
}

SE2 SE2::inverse() const { return {-(cosine_ * x() + sine_ * y()), sine_ * x() - cosine_ * y(), -angle_}; }

SE3 SE2::to_se3(double z_m) const {
  return {rotation_from_roll_pitch_yaw({0, 0, angle_}), Vec3(x(), y(), z_m)};
}

SE2 SE2::operator*(const SE2& other) const { return {*this * other.translation_, angle_ + other.angle_}; }

Vec3 roll_pitch_yaw(const Mat3& rotation) {
  return {std::atan2(rotation(2, 1), rotation(2, 2)),
          std::atan2(-rotation(2, 0), std::hypot(rotation(0, 0), rotation(1, 0))),
          std::atan2(rotation(1, 0), rotation(0, 0))};
}

Mat3 rotation_from_roll_pitch_yaw(const Vec3& roll_pitch_yaw_rad) {
  const double cr = std::cos(roll_pitch_yaw_rad.x()), sr = std::sin(roll_pitch_yaw_rad.x());
  const double cp = std::cos(roll_pitch_yaw_rad.y()), sp = std::sin(roll_pitch_yaw_rad.y());
  const double cy = std::cos(roll_pitch_yaw_rad.z()), sy = std::sin(roll_pitch_yaw_rad.z());
  Mat3 rotation;
  rotation << cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr,  //
      sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr,          //
      -sp, cp * sr, cp * cr;
  return rotation;
}

}  // namespace hm
