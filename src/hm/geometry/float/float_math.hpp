#pragma once
#include <Eigen/Core>

namespace hm {

/// Single-precision vector of the flight controllers, without alignment: the same size, layout and operations
/// on every processor.
using Vec3f = Eigen::Matrix<float, 3, 1, Eigen::DontAlign>;

inline constexpr float kPiF = 3.14159265F;
inline constexpr float kGravityF_m_s2 = 9.80665F;

struct SinCos {
  float sin, cos;
};

/// Elementary functions in single precision that give the same bits on every processor: only additions,
/// multiplications, divisions and square roots, each rounded once (compile with -ffp-contract=off).
/// Polynomials interpolate the functions at Chebyshev nodes. NaN in gives NaN out; nothing else does unless
/// said.
///
/// Sine and cosine of an angle in radians; absolute error below 1.2e-7 for |angle| <= 8192, beyond that the
/// angle is first taken modulo the single-precision 2 pi. Infinity gives NaN.
[[nodiscard]] SinCos sin_cos_f(float angle_rad);
/// Angle of the vector (x, y) in [-pi, pi], relative error below 4e-7; 0 for the zero vector.
[[nodiscard]] float atan2_f(float y, float x);
/// Arc sine; arguments beyond +-1 are taken as +-1. Absolute error below 4e-7.
[[nodiscard]] float asin_f(float sine);
/// e^x, relative error below 2e-7 for x in [-87, 88]; x beyond is clamped to that interval.
[[nodiscard]] float exp_f(float x);
/// Natural logarithm of a positive normal number, absolute error below 1e-7 + 1.2e-7 |result|; NaN for
/// others.
[[nodiscard]] float log_f(float x);
/// The angle modulo 2 pi in [-pi, pi]; absolute error below 4e-7 for |angle| <= 8192. Infinity gives NaN.
[[nodiscard]] float wrap_angle_f(float angle_rad);

/// Sum of products in the order of the elements.
[[nodiscard]] inline float dot_f(const Vec3f& a, const Vec3f& b) {
  return a.x() * b.x() + a.y() * b.y() + a.z() * b.z();
}
[[nodiscard]] inline Vec3f cross_f(const Vec3f& a, const Vec3f& b) {
  return {a.y() * b.z() - a.z() * b.y(), a.z() * b.x() - a.x() * b.z(), a.x() * b.y() - a.y() * b.x()};
}
[[nodiscard]] float norm_f(const Vec3f& v);
/// Length of (x, y).
[[nodiscard]] float norm_f(float x, float y);
[[nodiscard]] bool is_finite_f(const Vec3f& v);

/// The value within [low, high]; low where the interval is empty, and for NaN.
[[nodiscard]] inline float clamp_f(float value, float low, float high) {
  if (!(value > low)) return low;
  return value < high ? value : (high > low ? high : low);
}
[[nodiscard]] inline float min_f(float a, float b) { return b < a ? b : a; }
[[nodiscard]] inline float max_f(float a, float b) { return a < b ? b : a; }

}  // namespace hm
