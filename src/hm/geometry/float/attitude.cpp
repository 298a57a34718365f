#include "hm/geometry/float/attitude.hpp"

#include <cmath>

namespace hm {

Vec3f Attitude::rotate(const Vec3f& v) const {
  // v + 2 w (q x v) + 2 q x (q x v)
  const Vec3f q(x, y, z);
  const Vec3f twice = 2 * cross_f(q, v);
  return v + w * twice + cross_f(q, twice);
}

float Attitude::tilt_rad() const {
  const Vec3f up = up_axis();
  return atan2_f(norm_f(up.x(), up.y()), up.z());
}

Attitude attitude_from(const EulerAngles& angles) {
  const auto [sr, cr] = sin_cos_f(0.5F * angles.roll_rad);
  const auto [sp, cp] = sin_cos_f(0.5F * angles.pitch_rad);
  const auto [sy, cy] = sin_cos_f(0.5F * angles.yaw_rad);
  return {cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
          cr * cp * sy - sr * sp * cy};
}

EulerAngles euler_angles(const Attitude& q) {
  return {atan2_f(2 * (q.w * q.x + q.y * q.z), 1 - 2 * (q.x * q.x + q.y * q.y)),
          asin_f(2 * (q.w * q.y - q.z * q.x)),
          atan2_f(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))};
}

namespace {
float squared_length(const Attitude& q) { return q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z; }
}  // namespace

Attitude normalised(const Attitude& q) {
  const float length = std::sqrt(squared_length(q));
  if (!(length >= 1e-6F && length <= 1e6F)) return {};
  const float scale = 1 / length;
  return {q.w * scale, q.x * scale, q.y * scale, q.z * scale};
}

bool is_unit(const Attitude& attitude) {
  const float squared = squared_length(attitude);
  return squared > 0.98F && squared < 1.02F;
}

Attitude attitude_turned_by(const Vec3f& rotation_vector_rad) {
  const float angle = norm_f(rotation_vector_rad);
  // sin(a/2)/a, by its series where the division would lose digits
  const auto [sine, cosine] = sin_cos_f(0.5F * angle);
  const float scale = angle > 1e-3F ? sine / angle : 0.5F - angle * angle * (1.0F / 48);
  return {cosine, scale * rotation_vector_rad.x(), scale * rotation_vector_rad.y(),
          scale * rotation_vector_rad.z()};
}

EulerAngles tilt_towards(const Vec3f& up, float yaw_rad) {
  const auto [sine, cosine] = sin_cos_f(yaw_rad);
  const float forward = cosine * up.x() + sine * up.y(), left = cosine * up.y() - sine * up.x();
  // In the frame turned by yaw the axis is (sin(p) cos(r), -sin(r), cos(p) cos(r)).
  return {atan2_f(-left, norm_f(forward, up.z())), atan2_f(forward, up.z()), wrap_angle_f(yaw_rad)};
}

}  // namespace hm
