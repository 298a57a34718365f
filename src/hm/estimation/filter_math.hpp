#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <type_traits>

#include "hm/core/time.hpp"
#include "hm/geometry/float/float_math.hpp"

namespace hm {

// What the filters compute with, for double and for float. The double functions are those of `geometry` and
// of the C library. The float ones are those of geometry/float, which give the same bits on a host and on a
// microcontroller.

/// Alignment for vector instructions depends on the CPU, and with it Eigen's order of summation: floats have
/// none.
template <class Scalar>
inline constexpr int kFilterAlignment = std::is_same_v<Scalar, float> ? Eigen::DontAlign : Eigen::AutoAlign;
template <class Scalar, int N>
using FilterVector = Eigen::Matrix<Scalar, N, 1, Eigen::ColMajor | kFilterAlignment<Scalar>>;
template <class Scalar, int N>
using FilterMatrix = Eigen::Matrix<Scalar, N, N, Eigen::ColMajor | kFilterAlignment<Scalar>>;
template <class Scalar>
using FilterQuaternion = Eigen::Quaternion<Scalar, kFilterAlignment<Scalar>>;

/// Standard gravity, in the filters' scalar.
template <class Scalar>
inline constexpr Scalar kFilterGravity_m_s2 = Scalar(9.80665);

/// Wraps an angle (radians, finite) to (-pi, pi].
double wrap_angle(double angle_rad);
float wrap_angle(float angle_rad);

struct SinCosDouble {
  double sin, cos;
};
inline SinCosDouble filter_sin_cos(double angle_rad) { return {std::sin(angle_rad), std::cos(angle_rad)}; }
inline SinCos filter_sin_cos(float angle_rad) { return sin_cos_f(angle_rad); }
/// The angle of (x, y).
inline double filter_atan2(double y, double x) { return std::atan2(y, x); }
inline float filter_atan2(float y, float x) { return atan2_f(y, x); }

/// Rotation Rz(yaw) Ry(pitch) Rx(roll), and its angles in radians.
FilterMatrix<double, 3> rotation_from_angles(const FilterVector<double, 3>& roll_pitch_yaw_rad);
FilterMatrix<float, 3> rotation_from_angles(const FilterVector<float, 3>& roll_pitch_yaw_rad);
FilterVector<double, 3> angles_of(const FilterMatrix<double, 3>& rotation);
FilterVector<float, 3> angles_of(const FilterMatrix<float, 3>& rotation);

/// Rotates a unit quaternion by a rotation vector (radians) given in its body frame.
FilterQuaternion<double> turned(const FilterQuaternion<double>& rotation,
                                const FilterVector<double, 3>& vector);
FilterQuaternion<float> turned(const FilterQuaternion<float>& rotation, const FilterVector<float, 3>& vector);
/// Shortest rotation that takes the direction `from` to `to`, neither of them zero.
FilterQuaternion<double> shortest_turn(const FilterVector<double, 3>& from,
                                       const FilterVector<double, 3>& to);
FilterQuaternion<float> shortest_turn(const FilterVector<float, 3>& from, const FilterVector<float, 3>& to);

/// Length of a time span in seconds. Floats: no 64-bit conversion where the span is below 2 s.
template <class Scalar>
[[nodiscard]] constexpr Scalar seconds_of(Duration duration) {
  if constexpr (std::is_same_v<Scalar, double>) {
    return duration.seconds();
  } else {
    const auto short_ns = static_cast<std::int32_t>(duration.ns);
    if (short_ns == duration.ns) return static_cast<Scalar>(short_ns) * Scalar(1e-9);
    // Beyond 2 s in units of 2^20 ns, beyond 26 days not more than that.
    const std::int64_t units = duration.ns / (1 << 20), most = 0x7fffffff;
    const auto bounded = static_cast<std::int32_t>(units > most ? most : units < -most ? -most : units);
    return static_cast<Scalar>(bounded) * Scalar((1 << 20) * 1e-9);
  }
}

/// The inverse; floats: to a microsecond, for spans below half an hour.
template <class Scalar>
[[nodiscard]] constexpr Duration duration_of(Scalar seconds) {
  if constexpr (std::is_same_v<Scalar, double>) {
    return Duration::from_seconds(seconds);
  } else {
    const Scalar rounded = seconds * Scalar(1e6) + (seconds < 0 ? Scalar(-0.5) : Scalar(0.5));
    return {std::int64_t{1000} * static_cast<std::int32_t>(rounded)};
  }
}

/// (cosine, -sine; sine, cosine) of an angle.
template <class Scalar>
[[nodiscard]] FilterMatrix<Scalar, 2> planar_rotation(Scalar angle_rad) {
  const auto [s, c] = filter_sin_cos(angle_rad);
  FilterMatrix<Scalar, 2> rotation;
  rotation << c, -s, s, c;
  return rotation;
}

}  // namespace hm
