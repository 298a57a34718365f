#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "hm/geometry/se3.hpp"

/// The only place where the frames of autopilots are known. Ours: world x east (or forward at the start), y
/// left, z up (ENU), body x forward, y left, z up (FLU). Theirs: world north, east, down (NED) or forward,
/// right, down (FRD), body FRD.
namespace hm {

/// The autopilot's world.
enum class AutopilotWorld {
  kNed,       ///< ours is ENU with x to the east: p_ned = (y, x, -z), yaw_ned = pi/2 - yaw
  kLocalFrd,  ///< ours has x forward at the start: p = (x, -y, -z), yaw = -yaw
};

/// Vectors of the world (position, velocity, acceleration). Each is its own inverse.
[[nodiscard]] Vec3 swap_world(const Vec3& vector, AutopilotWorld world);
/// Vectors of the body, rates among them: (x, -y, -z). Its own inverse.
[[nodiscard]] Vec3 swap_body(const Vec3& vector);
/// Orientation of the body in the world, from ours to theirs or back. Its own inverse; w >= 0.
[[nodiscard]] Eigen::Quaterniond swap_orientation(const Eigen::Quaterniond& q, AutopilotWorld world);
/// Yaw in radians, from ours to theirs or back, in (-pi, pi].
[[nodiscard]] double swap_yaw(double yaw_rad, AutopilotWorld world);
/// Rate of the yaw. Its own inverse.
[[nodiscard]] inline double swap_yaw_rate(double rate_rad_s) { return -rate_rad_s; }

/// Covariance of (x y z, rotation about x y z) with both parts in the world, or both in the body.
[[nodiscard]] Mat6 swap_world_covariance(const Mat6& covariance, AutopilotWorld world);
[[nodiscard]] Mat6 swap_body_covariance(const Mat6& covariance);

/// Roll, pitch and yaw (radians, R = Rz Ry Rx) of an orientation; pitch in [-pi/2, pi/2].
[[nodiscard]] Vec3 roll_pitch_yaw(const Eigen::Quaterniond& q);

/// MAVLink's upper triangle of a symmetric 6x6 matrix, row by row: the variances stand at 0, 6, 11, 15,
/// 18, 20.
using MavlinkCovariance = std::array<float, 21>;
[[nodiscard]] MavlinkCovariance upper_triangle(const Mat6& covariance);
[[nodiscard]] Mat6 from_upper_triangle(const MavlinkCovariance& covariance);
/// NaN first, zero elsewhere: unknown.
[[nodiscard]] MavlinkCovariance unknown_covariance();

}  // namespace hm
