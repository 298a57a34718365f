#include "hm/estimation/filter_math.hpp"

namespace hm {
namespace {

// Taylor series on |x| <= pi/4: the first term that is left out is below 3e-9.
float sine_series(float x) {
  const float s = x * x;
  return x * (1.0F + s * (-1.0F / 6 + s * (1.0F / 120 + s * (-1.0F / 5040 + s * (1.0F / 362880)))));
}
float cosine_series(float x) {
  const float s = x * x;
  return 1.0F +
         s * (-0.5F + s * (1.0F / 24 + s * (-1.0F / 720 + s * (1.0F / 40320 + s * (-1.0F / 3628800)))));
}

struct Quarter {
  int turns;       // quarter turns, modulo 4
  float rest_rad;  // within +-pi/4
};

/// Splits an angle. pi/2 in three parts, the first two with so few bits that their multiples are exact.
Quarter quarter_of(float angle_rad) {
  constexpr float kQuartersPerRadian = 0.636619772F, kFirst = 1.5703125F, kSecond = 4.83751297e-4F,
                  kThird = 7.54978995e-8F;
  const float quarters = std::floor(angle_rad * kQuartersPerRadian + 0.5F);
  const float rest = ((angle_rad - quarters * kFirst) - quarters * kSecond) - quarters * kThird;
  return {static_cast<int>(quarters) & 3, rest};
}

/// Arc tangent on 0..1; beyond tan(pi/8) about pi/4, so that the series needs nine terms.
float arc_tangent(float x) {
  constexpr float kEighthTangent = 0.414213562F, kEighthTurn = 0.785398163F;
  const bool upper = x > kEighthTangent;
  const float t = upper ? (x - 1.0F) / (x + 1.0F) : x, s = t * t;
  float sum = 1.0F / 17;
  for (int odd = 15; odd >= 1; odd -= 2) sum = 1.0F / static_cast<float>(odd) - s * sum;
  return (upper ? kEighthTurn : 0.0F) + t * sum;
}

}  // namespace

float filter_sin(float angle_rad) {
  const Quarter part = quarter_of(angle_rad);
  const float value = (part.turns & 1) != 0 ? cosine_series(part.rest_rad) : sine_series(part.rest_rad);
  return (part.turns & 2) != 0 ? -value : value;
}

float filter_cos(float angle_rad) {
  const Quarter part = quarter_of(angle_rad);
  const float value = (part.turns & 1) != 0 ? sine_series(part.rest_rad) : cosine_series(part.rest_rad);
  return part.turns == 1 || part.turns == 2 ? -value : value;
}

float filter_atan2(float y, float x) {
  constexpr float kPi = std::numbers::pi_v<float>;
  const float a = std::abs(x), b = std::abs(y);
  if (a == 0 && b == 0) return 0;
  float angle = b > a ? 0.5F * kPi - arc_tangent(a / b) : arc_tangent(b / a);
  if (x < 0) angle = kPi - angle;
  return y < 0 ? -angle : angle;
}

float wrap_angle(float angle_rad) {
  constexpr float kPi = std::numbers::pi_v<float>, kTurn = 2.0F * kPi;
  if (angle_rad > -kPi && angle_rad <= kPi) return angle_rad;
  const float wrapped = angle_rad - kTurn * std::floor(angle_rad / kTurn + 0.5F);
  return wrapped <= -kPi ? wrapped + kTurn : wrapped > kPi ? kPi : wrapped;
}

FilterMatrix<float, 3> rotation_from_angles(const FilterVector<float, 3>& roll_pitch_yaw_rad) {
  const float cr = filter_cos(roll_pitch_yaw_rad.x()), sr = filter_sin(roll_pitch_yaw_rad.x());
  const float cp = filter_cos(roll_pitch_yaw_rad.y()), sp = filter_sin(roll_pitch_yaw_rad.y());
  const float cy = filter_cos(roll_pitch_yaw_rad.z()), sy = filter_sin(roll_pitch_yaw_rad.z());
  FilterMatrix<float, 3> rotation;
  rotation << cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr,  //
      sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr,          //
      -sp, cp * sr, cp * cr;
  return rotation;
}

FilterVector<float, 3> angles_of(const FilterMatrix<float, 3>& rotation) {
  const float level = std::sqrt(rotation(0, 0) * rotation(0, 0) + rotation(1, 0) * rotation(1, 0));
  return {filter_atan2(rotation(2, 1), rotation(2, 2)), filter_atan2(-rotation(2, 0), level),
          filter_atan2(rotation(1, 0), rotation(0, 0))};
}

namespace {

FilterQuaternion<float> normalised(float w, float x, float y, float z) {
  const float scale = 1.0F / std::sqrt(((w * w + x * x) + y * y) + z * z);
  return {scale * w, scale * x, scale * y, scale * z};
}

}  // namespace

FilterQuaternion<float> turned(const FilterQuaternion<float>& rotation,
                               const FilterVector<float, 3>& vector) {
  const float square = (vector.x() * vector.x() + vector.y() * vector.y()) + vector.z() * vector.z();
  const float angle = std::sqrt(square);
  // sin(a/2)/a by its series where the quotient loses digits.
  const float scale = angle < 0.02F ? 0.5F - square / 48 : filter_sin(0.5F * angle) / angle;
  const float w = filter_cos(0.5F * angle), x = scale * vector.x(), y = scale * vector.y(),
              z = scale * vector.z();
  // Written out: Eigen's product of floats is another sum on every CPU.
  const FilterQuaternion<float>& r = rotation;
  return normalised(
      r.w() * w - r.x() * x - r.y() * y - r.z() * z, r.w() * x + r.x() * w + r.y() * z - r.z() * y,
      r.w() * y - r.x() * z + r.y() * w + r.z() * x, r.w() * z + r.x() * y - r.y() * x + r.z() * w);
}

FilterQuaternion<float> shortest_turn(const FilterVector<float, 3>& from, const FilterVector<float, 3>& to) {
  const FilterVector<float, 3> a = from / from.norm(), b = to / to.norm();
  const float w = 1.0F + a.dot(b);
  if (w < 1e-6F) {  // half a turn about any axis across
    const FilterVector<float, 3> other =
        std::abs(a.x()) < 0.6F ? FilterVector<float, 3>(1, 0, 0) : FilterVector<float, 3>(0, 1, 0);
    const FilterVector<float, 3> axis = a.cross(other);
    return normalised(0, axis.x(), axis.y(), axis.z());
  }
  const FilterVector<float, 3> axis = a.cross(b);
  return normalised(w, axis.x(), axis.y(), axis.z());
}

}  // namespace hm
