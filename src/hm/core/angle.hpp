#pragma once
#include <numbers>

namespace hm {

/// Angles are radians everywhere but at the user's edge: 30 * kRadiansPerDegree, angle_rad *
/// kDegreesPerRadian.
inline constexpr double kRadiansPerDegree = std::numbers::pi / 180;
inline constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

}  // namespace hm
