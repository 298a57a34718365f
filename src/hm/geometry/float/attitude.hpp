#pragma once
#include "hm/geometry/float/float_math.hpp"

namespace hm {

/// Unit quaternion in single precision, w + x i + y j + z k: as the attitude of the vehicle it turns
/// coordinates of `base` (x forward, y left, z up) into those of `odom` (z up).
struct Attitude {
  float w = 1, x = 0, y = 0, z = 0;

  /// First b, then a.
  friend Attitude operator*(const Attitude& a, const Attitude& b) {
    return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
  }
  friend bool operator==(const Attitude&, const Attitude&) = default;
  [[nodiscard]] Attitude inverse() const { return {w, -x, -y, -z}; }
  [[nodiscard]] Vec3f rotate(const Vec3f& v) const;
  [[nodiscard]] Vec3f rotate_back(const Vec3f& v) const { return inverse().rotate(v); }
  /// The vehicle's z axis, along which its rotors lift.
  [[nodiscard]] Vec3f up_axis() const {
    return {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)};
  }
  /// Angle between the vehicle's z axis and the vertical, 0 to pi.
  [[nodiscard]] float tilt_rad() const;
};

/// Angles of Rz(yaw) Ry(pitch) Rx(roll), radians.
struct EulerAngles {
  float roll_rad = 0, pitch_rad = 0, yaw_rad = 0;
};
[[nodiscard]] Attitude attitude_from(const EulerAngles& angles);
/// Roll and yaw in [-pi, pi], pitch in [-pi/2, pi/2].
[[nodiscard]] EulerAngles euler_angles(const Attitude& attitude);
/// Scaled to length 1; the identity if the length is not between 1e-6 and 1e6, or not a number.
[[nodiscard]] Attitude normalised(const Attitude& attitude);
/// Whether all components are numbers and the length is 1 within 1 %.
[[nodiscard]] bool is_unit(const Attitude& attitude);

/// Rotation by the vector's length about its direction.
[[nodiscard]] Attitude attitude_turned_by(const Vec3f& rotation_vector_rad);

/// Roll and pitch that point the vehicle's z axis along `up` (odom frame, any positive length, not below the
/// horizon) at this yaw.
[[nodiscard]] EulerAngles tilt_towards(const Vec3f& up, float yaw_rad);

}  // namespace hm
