#pragma once
#include "hm/geometry/se3.hpp"
#include "hm/sim/vehicle/vehicle_params.hpp"

namespace hm {

/// Command to a vehicle with attitude loops of its own, as in the dissertation's packet CTRL_INPUT.
struct InnerLoopCommand {
  double roll_rad = 0, pitch_rad = 0;  ///< attitude Rz(yaw) Ry(pitch) Rx(roll) in the world
  double yaw_rate_rad_s = 0;           ///< about the body's z axis
  double thrust_ratio = 0;             ///< share of the maximum thrust at nominal voltage, 0..1
};

/// Angular acceleration (base frame, rad/s^2) that a built-in attitude loop brings about, roll and pitch
/// separate from yaw. With e the rotation vector from the attitude to the commanded one:
///   second order: dw = w0^2 e - 2 zeta w0 w,
///   first order:  w follows e / tau, towards gain times the commanded angles, with a lag of 5 ms that keeps
///                 the angular velocity continuous.
/// The yaw rate follows its command with its time constant. Commands are limited to 1.2 rad and 10 rad/s.
/// Zero for InnerLoopKind::kMotors.
Vec3 inner_loop_acceleration(const InnerLoopParams& params, const InnerLoopCommand& command,
                             const Mat3& R_world_base, const Vec3& angular_velocity_base_rad_s);

}  // namespace hm
