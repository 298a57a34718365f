#include "hm/sim/vehicle/inner_loop.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

constexpr double kMaxTilt_rad = 1.2, kMaxYawRate_rad_s = 10;  ///< limits of commands
constexpr double kRateLag_s = 0.005;  ///< short against attitude_time_constant_s, long against a step of 1 ms

/// Rotation with these roll and pitch angles and the yaw of another rotation.
Mat3 with_same_yaw(const Mat3& rotation, double roll_rad, double pitch_rad) {
  const double yaw_rad = std::atan2(rotation(1, 0), rotation(0, 0));
  using Axis = Eigen::AngleAxisd;
  return (Axis(yaw_rad, Vec3::UnitZ()) * Axis(pitch_rad, Vec3::UnitY()) * Axis(roll_rad, Vec3::UnitX()))
      .toRotationMatrix();
}

}  // namespace

Vec3 inner_loop_acceleration(const InnerLoopParams& params, const InnerLoopCommand& command,
                             const Mat3& R_world_base, const Vec3& angular_velocity_base_rad_s) {
  const Vec3& w = angular_velocity_base_rad_s;
  if (params.inner_loop == InnerLoopKind::kMotors) return Vec3::Zero();
  const bool first_order = params.inner_loop == InnerLoopKind::kFirstOrder;
  const double gain = first_order ? params.attitude_gain : 1;
  const auto limited = [gain](double angle_rad) {
    return gain * std::clamp(angle_rad, -kMaxTilt_rad, kMaxTilt_rad);
  };
  const Mat3 target = with_same_yaw(R_world_base, limited(command.roll_rad), limited(command.pitch_rad));
  const Vec3 error = so3_log(R_world_base.transpose() * target);
  constexpr double kFrequency = InnerLoopParams::kAttitudeFrequency_rad_s;
  Vec3 acceleration = first_order ? Vec3((error / params.attitude_time_constant_s - w) / kRateLag_s)
                                  : Vec3(kFrequency * kFrequency * error -
                                         2 * InnerLoopParams::kAttitudeDamping_ratio * kFrequency * w);
  acceleration.z() = (std::clamp(command.yaw_rate_rad_s, -kMaxYawRate_rad_s, kMaxYawRate_rad_s) - w.z()) /
                     params.kYawRateTimeConstant_s;
  return acceleration;
}

}  // namespace hm
