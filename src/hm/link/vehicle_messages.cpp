#include "hm/link/vehicle_messages.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "hm/link/codec/mavlink_enums.hpp"

namespace hm {
namespace {

constexpr std::int64_t kNsPerUs = 1000, kNsPerMs = 1'000'000;

bool is_variance_matrix(const std::optional<Mat6>& covariance) {
  return !covariance || (covariance->allFinite() && covariance->diagonal().minCoeff() >= 0);
}

bool is_usable(const LinkState& state) {
  return is_rigid(state.T_odom_base) && state.velocity_body.allFinite() && state.rates_body.allFinite() &&
         is_variance_matrix(state.pose_covariance) && is_variance_matrix(state.velocity_covariance) &&
         state.stamp.ns >= 0;
}

std::uint32_t boot_ms(Time stamp, Time boot) {
  return static_cast<std::uint32_t>((stamp - boot).ns / kNsPerMs);
}

/// Three numbers to or from three fields of a message.
void put(const Vec3& vector, float& x, float& y, float& z) {
  x = static_cast<float>(vector.x());
  y = static_cast<float>(vector.y());
  z = static_cast<float>(vector.z());
}
Vec3 vector_of(float x, float y, float z) {
  return {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
}

std::array<float, 4> wxyz(const Eigen::Quaterniond& q) {
  return {static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()),
          static_cast<float>(q.z())};
}
Eigen::Quaterniond quaternion_of(const std::array<float, 4>& q) {
  return {static_cast<double>(q[0]), static_cast<double>(q[1]), static_cast<double>(q[2]),
          static_cast<double>(q[3])};
}
/// Largest error of the length of a quaternion that rounding explains.
constexpr double kQuaternionTolerance = 1e-3;
bool is_unit(const Eigen::Quaterniond& q) { return std::abs(q.norm() - 1) < kQuaternionTolerance; }

}  // namespace

std::optional<MavOdometry> to_odometry(const LinkState& state) {
  if (!is_usable(state)) return std::nullopt;
  constexpr AutopilotWorld kWorld = AutopilotWorld::kLocalFrd;
  MavOdometry message;
  message.time_usec = static_cast<std::uint64_t>(state.stamp.ns / kNsPerUs);
  message.frame_id = kMavFrameLocalFrd;
  message.child_frame_id = kMavFrameBodyFrd;
  put(swap_world(state.T_odom_base.translation(), kWorld), message.x, message.y, message.z);
  message.q = wxyz(swap_orientation(state.T_odom_base.quaternion(), kWorld));
  put(swap_body(state.velocity_body), message.vx, message.vy, message.vz);
  put(swap_body(state.rates_body), message.rollspeed, message.pitchspeed, message.yawspeed);
  message.pose_covariance = unknown_covariance();
  if (state.pose_covariance)
    message.pose_covariance = upper_triangle(swap_world_covariance(*state.pose_covariance, kWorld));
  message.velocity_covariance = unknown_covariance();
  if (state.velocity_covariance)
    message.velocity_covariance = upper_triangle(swap_body_covariance(*state.velocity_covariance));
  message.reset_counter = state.reset_counter;
  message.estimator_type = kMavEstimatorVision;
  message.quality = state.quality_percent;
  return message;
}

std::string_view odometry_fault(const MavOdometry& message) {
  if (message.frame_id != kMavFrameLocalFrd) return "frame_id is not LOCAL_FRD (20)";
  if (message.child_frame_id != kMavFrameBodyFrd) return "child_frame_id is not BODY_FRD (12)";
  if (!vector_of(message.x, message.y, message.z).allFinite()) return "the position is not finite";
  if (!is_unit(quaternion_of(message.q))) return "the quaternion's length is not 1";
  if (!vector_of(message.vx, message.vy, message.vz).allFinite()) return "the velocity is not finite";
  if (!vector_of(message.rollspeed, message.pitchspeed, message.yawspeed).allFinite())
    return "the rates are not finite";
  return {};
}

std::optional<LinkState> from_odometry(const MavOdometry& message) {
  if (!odometry_fault(message).empty()) return std::nullopt;
  constexpr AutopilotWorld kWorld = AutopilotWorld::kLocalFrd;
  LinkState state;
  state.stamp.ns = static_cast<std::int64_t>(message.time_usec) * kNsPerUs;
  state.T_odom_base = SE3(swap_orientation(quaternion_of(message.q), kWorld),
                          swap_world(vector_of(message.x, message.y, message.z), kWorld));
  state.velocity_body = swap_body(vector_of(message.vx, message.vy, message.vz));
  state.rates_body = swap_body(vector_of(message.rollspeed, message.pitchspeed, message.yawspeed));
  if (std::isfinite(message.pose_covariance[0]))
    state.pose_covariance = swap_world_covariance(from_upper_triangle(message.pose_covariance), kWorld);
  if (std::isfinite(message.velocity_covariance[0]))
    state.velocity_covariance = swap_body_covariance(from_upper_triangle(message.velocity_covariance));
  state.reset_counter = message.reset_counter;
  state.quality_percent = message.quality;
  return state;
}

std::optional<MavVisionPositionEstimate> to_vision_position(const LinkState& state, AutopilotWorld world) {
  if (!is_usable(state)) return std::nullopt;
  MavVisionPositionEstimate message;
  message.usec = static_cast<std::uint64_t>(state.stamp.ns / kNsPerUs);
  put(swap_world(state.T_odom_base.translation(), world), message.x, message.y, message.z);
  put(roll_pitch_yaw(swap_orientation(state.T_odom_base.quaternion(), world)), message.roll, message.pitch,
      message.yaw);
  message.covariance = unknown_covariance();
  if (state.pose_covariance)
    message.covariance = upper_triangle(swap_world_covariance(*state.pose_covariance, world));
  message.reset_counter = state.reset_counter;
  return message;
}

MavAttitude to_attitude(const LinkState& state, Time boot, AutopilotWorld world) {
  MavAttitude message;
  message.time_boot_ms = boot_ms(state.stamp, boot);
  put(roll_pitch_yaw(swap_orientation(state.T_odom_base.quaternion(), world)), message.roll, message.pitch,
      message.yaw);
  put(swap_body(state.rates_body), message.rollspeed, message.pitchspeed, message.yawspeed);
  return message;
}

MavAttitudeQuaternion to_attitude_quaternion(const LinkState& state, Time boot, AutopilotWorld world) {
  MavAttitudeQuaternion message;
  message.time_boot_ms = boot_ms(state.stamp, boot);
  const auto q = wxyz(swap_orientation(state.T_odom_base.quaternion(), world));
  message.q1 = q[0];
  message.q2 = q[1];
  message.q3 = q[2];
  message.q4 = q[3];
  put(swap_body(state.rates_body), message.rollspeed, message.pitchspeed, message.yawspeed);
  return message;
}

MavLocalPositionNed to_local_position(const LinkState& state, Time boot, AutopilotWorld world) {
  MavLocalPositionNed message;
  message.time_boot_ms = boot_ms(state.stamp, boot);
  put(swap_world(state.T_odom_base.translation(), world), message.x, message.y, message.z);
  put(swap_world(state.T_odom_base.rotation() * state.velocity_body, world), message.vx, message.vy,
      message.vz);
  return message;
}

std::optional<MavSetPositionTargetLocalNed> to_position_target(const LinkSetPoint& set_point, Time stamp,
                                                               Time boot, AutopilotWorld world) {
  MavSetPositionTargetLocalNed message;
  message.time_boot_ms = boot_ms(stamp, boot);
  message.coordinate_frame = kMavFrameLocalNed;
  bool finite = true, any = false;
  unsigned ignored = 0;
  const auto put_vector = [&](const std::optional<Vec3>& vector, unsigned bits, float& x, float& y,
                              float& z) {
    any |= vector.has_value();
    if (!vector) return static_cast<void>(ignored |= bits);
    finite &= vector->allFinite();
    put(swap_world(*vector, world), x, y, z);
  };
  put_vector(set_point.position_m, kMavIgnorePosition, message.x, message.y, message.z);
  put_vector(set_point.velocity_m_s, kMavIgnoreVelocity, message.vx, message.vy, message.vz);
  put_vector(set_point.acceleration_m_s2, kMavIgnoreAcceleration, message.afx, message.afy, message.afz);
  const auto put_number = [&](const std::optional<double>& number, unsigned bits, auto swap, float& field) {
    any |= number.has_value();
    if (!number) return static_cast<void>(ignored |= bits);
    finite &= std::isfinite(*number);
    if (std::isfinite(*number)) field = static_cast<float>(swap(*number));
  };
  put_number(
      set_point.yaw_rad, kMavIgnoreYaw, [&](double yaw) { return swap_yaw(yaw, world); }, message.yaw);
  put_number(set_point.yaw_rate_rad_s, kMavIgnoreYawRate, swap_yaw_rate, message.yaw_rate);
  message.type_mask = static_cast<std::uint16_t>(ignored);
  if (!finite || !any) return std::nullopt;
  return message;
}

std::optional<LinkSetPoint> from_position_target(const MavSetPositionTargetLocalNed& message,
                                                 AutopilotWorld world) {
  if (message.coordinate_frame != kMavFrameLocalNed) return std::nullopt;
  LinkSetPoint result;
  bool finite = true;
  const auto take = [&](unsigned bits, const Vec3& vector, std::optional<Vec3>& out) {
    if ((message.type_mask & bits) != 0) return;
    finite &= vector.allFinite();
    out = swap_world(vector, world);
  };
  take(kMavIgnorePosition, vector_of(message.x, message.y, message.z), result.position_m);
  take(kMavIgnoreVelocity, vector_of(message.vx, message.vy, message.vz), result.velocity_m_s);
  take(kMavIgnoreAcceleration, vector_of(message.afx, message.afy, message.afz), result.acceleration_m_s2);
  if ((message.type_mask & kMavIgnoreYaw) == 0) {
    finite &= std::isfinite(message.yaw);
    if (finite) result.yaw_rad = swap_yaw(static_cast<double>(message.yaw), world);
  }
  if ((message.type_mask & kMavIgnoreYawRate) == 0) {
    finite &= std::isfinite(message.yaw_rate);
    result.yaw_rate_rad_s = swap_yaw_rate(static_cast<double>(message.yaw_rate));
  }
  if (!finite) return std::nullopt;
  return result;
}

std::optional<MavSetAttitudeTarget> to_attitude_target(const LinkAttitudeSetPoint& set_point, Time stamp,
                                                       Time boot, AutopilotWorld world) {
  MavSetAttitudeTarget message;
  message.time_boot_ms = boot_ms(stamp, boot);
  unsigned ignored = 0;
  message.q = {1, 0, 0, 0};
  if (!set_point.q_odom_base)
    ignored |= kMavIgnoreAttitude;
  else if (!is_unit(*set_point.q_odom_base))
    return std::nullopt;
  else
    message.q = wxyz(swap_orientation(*set_point.q_odom_base, world));
  if (!set_point.rates_body)
    ignored |= kMavIgnoreRates;
  else if (!set_point.rates_body->allFinite())
    return std::nullopt;
  else
    put(swap_body(*set_point.rates_body), message.body_roll_rate, message.body_pitch_rate,
        message.body_yaw_rate);
  if (!set_point.thrust)
    ignored |= kMavIgnoreThrust;
  else if (!(*set_point.thrust >= 0 && *set_point.thrust <= 1))
    return std::nullopt;
  else
    message.thrust = static_cast<float>(*set_point.thrust);
  message.type_mask = static_cast<std::uint8_t>(ignored);
  return message;
}

std::optional<LinkAttitudeSetPoint> from_attitude_target(const MavSetAttitudeTarget& message,
                                                         AutopilotWorld world) {
  LinkAttitudeSetPoint result;
  if ((message.type_mask & kMavIgnoreAttitude) == 0) {
    if (!is_unit(quaternion_of(message.q))) return std::nullopt;
    result.q_odom_base = swap_orientation(quaternion_of(message.q), world);
  }
  if ((message.type_mask & kMavIgnoreRates) == 0) {
    const Vec3 rates = vector_of(message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate);
    if (!rates.allFinite()) return std::nullopt;
    result.rates_body = swap_body(rates);
  }
  if ((message.type_mask & kMavIgnoreThrust) == 0) {
    if (!(message.thrust >= 0 && message.thrust <= 1)) return std::nullopt;
    result.thrust = static_cast<double>(message.thrust);
  }
  return result;
}

LinkSticks from_manual_control(const MavManualControl& message) {
  constexpr std::int16_t kNoAxis = 32767;
  const auto axis = [](std::int16_t value, double middle, double range) {
    return value == kNoAxis ? 0.0 : std::clamp((value - middle) / range, -1.0, 1.0);
  };
  return {axis(message.x, 0, 1000), -axis(message.y, 0, 1000), axis(message.z, 500, 500),
          -axis(message.r, 0, 1000), message.buttons};
}

}  // namespace hm
