#include "hm/geometry/float/float_math.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace hm {
namespace {

constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();
constexpr float kTwoPi = 2 * kPiF;
/// Angles up to here are reduced by whole quarter turns whose three parts multiply without rounding.
constexpr float kMaxReduced_rad = 8192;

/// Nearest whole number, halves away from zero.
int nearest(float x) { return static_cast<int>(x < 0 ? x - 0.5F : x + 0.5F); }

/// angle - quarters * pi/2, where pi/2 = 1.5703125 + 0.000483751297 + 7.5e-8: 11 bits in each of the first
/// two parts and at most 13 in `quarters` make exact products.
float without_quarters(float angle_rad, int quarters) {
  const auto n = static_cast<float>(quarters);
  return ((angle_rad - n * 1.5703125F) - n * 0.0004837512969970703F) - n * 7.54979013e-8F;
}

/// Sine and cosine for |x| <= pi/4.
SinCos sin_cos_of_eighth(float x) {
  const float z = x * x;
  const float sine = x + x * z * (-0.166666642F + z * (0.00833274797F + z * -0.000195878907F));
  const float cosine = 1 - 0.5F * z + z * z * (0.0416666642F + z * (-0.00138883025F + z * 2.45479423e-05F));
  return {sine, cosine};
}

/// Arc tangent for 0 <= x <= 1.
float atan_of_unit(float x) {
  constexpr float kTanEighth = 0.414213562F;  // tan(pi/8)
  const bool upper = x > kTanEighth;
  const float t = upper ? (x - 1) / (x + 1) : x;
  const float z = t * t;
  const float angle =
      t + t * z * (-0.333332866F + z * (0.199912384F + z * (-0.140241429F + z * 0.0852049217F)));
  return upper ? kPiF / 4 + angle : angle;
}

}  // namespace

SinCos sin_cos_f(float angle_rad) {
  if (!std::isfinite(angle_rad)) return {kNoNumber, kNoNumber};
  if (std::abs(angle_rad) > kMaxReduced_rad) angle_rad = std::remainder(angle_rad, kTwoPi);
  const int quarters = nearest(angle_rad * (2 / kPiF));
  const SinCos part = sin_cos_of_eighth(without_quarters(angle_rad, quarters));
  switch (static_cast<unsigned>(quarters) & 3U) {
    case 0:
      return part;
    case 1:
      return {part.cos, -part.sin};
    case 2:
      return {-part.sin, -part.cos};
    default:
      return {-part.cos, part.sin};
  }
}

float atan2_f(float y, float x) {
  if (std::isnan(x) || std::isnan(y)) return kNoNumber;
  const float width = std::abs(x), height = std::abs(y);
  if (width == 0 && height == 0) return 0;
  if (std::isinf(width) && std::isinf(height)) return atan2_f(std::copysign(1.0F, y), std::copysign(1.0F, x));
  float angle = height <= width ? atan_of_unit(height / width) : kPiF / 2 - atan_of_unit(width / height);
  if (x < 0) angle = kPiF - angle;
  return y < 0 ? -angle : angle;
}

float asin_f(float sine) {
  if (std::isnan(sine)) return kNoNumber;
  const float s = clamp_f(sine, -1, 1);
  return atan2_f(s, std::sqrt((1 - s) * (1 + s)));
}

float exp_f(float x) {
  if (std::isnan(x)) return kNoNumber;
  x = clamp_f(x, -87, 88);
  const int power = nearest(x * 1.44269504F);
  const auto n = static_cast<float>(power);
  const float r = (x - n * 0.693115234375F) - n * 3.19461833e-05F;  // ln 2 in two parts
  const float z = r * r;
  const float tail =
      0.5F + r * (0.166665778F + r * (0.0416665561F + r * (0.00836317334F + r * 0.00139261759F)));
  const float mantissa = 1 + (r + z * tail);
  return mantissa * std::bit_cast<float>(static_cast<std::uint32_t>(power + 127) << 23U);
}

float log_f(float x) {
  if (!(x >= std::numeric_limits<float>::min()) || std::isinf(x)) return kNoNumber;
  const auto bits = std::bit_cast<std::uint32_t>(x);
  int power = static_cast<int>(bits >> 23U) - 127;
  float mantissa = std::bit_cast<float>((bits & 0x007fffffU) | 0x3f800000U);
  if (mantissa > 1.41421356F) {
    mantissa *= 0.5F;
    ++power;
  }
  const float s = (mantissa - 1) / (mantissa + 1), z = s * s;  // ln m = 2 artanh(s)
  const float part = 2 * s + s * z * (0.666666865F + z * (0.3998878F + z * 0.295799494F));
  const auto n = static_cast<float>(power);
  return n * 0.693115234375F + (part + n * 3.19461833e-05F);
}

float wrap_angle_f(float angle_rad) {
  if (!std::isfinite(angle_rad)) return kNoNumber;
  if (std::abs(angle_rad) <= kPiF) return angle_rad;
  if (std::abs(angle_rad) > kMaxReduced_rad) return std::remainder(angle_rad, kTwoPi);
  const int turns = nearest(angle_rad / kTwoPi);
  float wrapped = without_quarters(angle_rad, 4 * turns);
  // The quotient is rounded: near half a turn it may be one too many or too few.
  if (wrapped > kPiF) wrapped = without_quarters(angle_rad, 4 * (turns + 1));
  if (wrapped < -kPiF) wrapped = without_quarters(angle_rad, 4 * (turns - 1));
  return clamp_f(wrapped, -kPiF, kPiF);
}

float norm_f(const Vec3f& v) { return std::sqrt(dot_f(v, v)); }

float norm_f(float x, float y) { return std::sqrt(x * x + y * y); }

bool is_finite_f(const Vec3f& v) {
  return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z());
}

}  // namespace hm
