#pragma once
#include <numbers>

namespace hm {

/// Conversion factors: 30 * kRadiansPerDegree, angle_rad * kDegreesPerRadian. All angles are radians except
/// in user-facing text and options.
inline constexpr double kRadiansPerDegree = std::numbers::pi / 180;
inline constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

}  // namespace hm
