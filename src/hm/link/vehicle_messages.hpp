#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string_view>

#include "hm/core/time.hpp"
#include "hm/geometry/se3.hpp"
#include "hm/link/codec/mavlink_table.hpp"
#include "hm/link/link_frames.hpp"

/// Our states and set-points as MAVLink messages, and back; the change of frames is in here.
namespace hm {

/// State estimate of a vehicle. World and body are ours (z up, FLU).
struct LinkState {
  Time stamp;
  SE3 T_odom_base;
  Vec3 velocity_body = Vec3::Zero();        ///< m/s
  Vec3 rates_body = Vec3::Zero();           ///< rad/s
  std::optional<Mat6> pose_covariance;      ///< (x y z, rotation about x y z) in odom
  std::optional<Mat6> velocity_covariance;  ///< (velocity, rates) in the body
  /// Counts up whenever T_odom_base jumps, so that the autopilot resets instead of believing in a movement.
  std::uint8_t reset_counter = 0;
  std::int8_t quality_percent = 0;  ///< 0: unknown, -1: failed
};

/// ODOMETRY as both PX4 and ArduPilot accept it: LOCAL_FRD, BODY_FRD, estimator type VISION, also when it was
/// a laser. Nothing if a number of the state is not finite or a variance is negative.
[[nodiscard]] std::optional<MavOdometry> to_odometry(const LinkState& state);
/// Why an ODOMETRY cannot be used; empty if it can.
[[nodiscard]] std::string_view odometry_fault(const MavOdometry& message);
/// The state of an ODOMETRY in LOCAL_FRD and BODY_FRD; nothing if odometry_fault() finds one.
[[nodiscard]] std::optional<LinkState> from_odometry(const MavOdometry& message);

/// VISION_POSITION_ESTIMATE, for receivers without ODOMETRY.
[[nodiscard]] std::optional<MavVisionPositionEstimate> to_vision_position(const LinkState& state,
                                                                          AutopilotWorld world);

/// Telemetry of our own vehicle for a ground station; `boot` is the time 0 of `time_boot_ms`.
[[nodiscard]] MavAttitude to_attitude(const LinkState& state, Time boot, AutopilotWorld world);
[[nodiscard]] MavAttitudeQuaternion to_attitude_quaternion(const LinkState& state, Time boot,
                                                           AutopilotWorld world);
[[nodiscard]] MavLocalPositionNed to_local_position(const LinkState& state, Time boot, AutopilotWorld world);

/// Set-point; the autopilot ignores what is not given.
struct LinkSetPoint {
  std::optional<Vec3> position_m, velocity_m_s, acceleration_m_s2;  ///< in odom
  std::optional<double> yaw_rad, yaw_rate_rad_s;
};
/// SET_POSITION_TARGET_LOCAL_NED. The frame number is LOCAL_NED with either world: PX4 takes no other, and
/// its local frame is that of the ODOMETRY it gets when yaw comes from it. Nothing if nothing is asked for or
/// a number is not finite.
[[nodiscard]] std::optional<MavSetPositionTargetLocalNed> to_position_target(const LinkSetPoint& set_point,
                                                                             Time stamp, Time boot,
                                                                             AutopilotWorld world);
[[nodiscard]] std::optional<LinkSetPoint> from_position_target(const MavSetPositionTargetLocalNed& message,
                                                               AutopilotWorld world);

/// Attitude and thrust (0..1).
struct LinkAttitudeSetPoint {
  std::optional<Eigen::Quaterniond> q_odom_base;
  std::optional<Vec3> rates_body;  ///< rad/s
  std::optional<double> thrust;
};
[[nodiscard]] std::optional<MavSetAttitudeTarget> to_attitude_target(const LinkAttitudeSetPoint& set_point,
                                                                     Time stamp, Time boot,
                                                                     AutopilotWorld world);
[[nodiscard]] std::optional<LinkAttitudeSetPoint> from_attitude_target(const MavSetAttitudeTarget& message,
                                                                       AutopilotWorld world);

/// A gamepad at the ground station, each -1 to 1: forward, left, up, counter-clockwise. An axis that it does
/// not have is 0; `up` is 0 with the stick in the middle.
struct LinkSticks {
  double forward = 0, left = 0, up = 0, turn = 0;
  std::uint16_t buttons = 0;
};
[[nodiscard]] LinkSticks from_manual_control(const MavManualControl& message);

}  // namespace hm
