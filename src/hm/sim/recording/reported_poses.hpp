#pragma once
#include <cstdint>
#include <vector>

#include "hm/geometry/se3.hpp"

namespace hm {

/// Drift of a visual-inertial odometry: standard deviations of the velocity error, as a share of the speed,
/// and of the yaw error gained per metre.
struct PoseDrift {
  double velocity_ratio = 0.005;
  double yaw_rad_m = 0.0005;
};

/// Poses as a visual-inertial odometry reports them, from true ones: every step is rotated by the accumulated
/// yaw error and scaled; roll and pitch are observable from gravity and stay exact.
std::vector<SE3> poses_of_visual_inertial_odometry(const std::vector<SE3>& truth, const PoseDrift& drift,
                                                   std::uint64_t seed);

/// Poses of a camera on a base with wheels, by those wheels (WheelErrors), from true ones: position in the
/// plane and heading err; height, pitch and roll are exact.
std::vector<SE3> poses_of_wheels(const std::vector<SE3>& truth, std::uint64_t seed);

}  // namespace hm
