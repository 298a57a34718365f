#pragma once
#include <optional>

#include "hm/geometry/se2.hpp"
#include "hm/laser/odometry/attitude_history.hpp"

namespace hm {

/// The pose of a sweep from scan matching: position and yaw of one moment, moved by the velocity, turned by
/// the attitude of each moment.
struct MatchedSweep {
  Time stamp;
  Vec3 p_odom = Vec3::Zero(), v_odom_m_s = Vec3::Zero();
  double yaw_rad = 0, yaw_rate_rad_s = 0;
  const AttitudeHistory* attitude = nullptr;
  double attitude_yaw_rad = 0;  // of the attitude at `stamp`

  [[nodiscard]] std::optional<SE3> at(Time time) const {
    const double dt_s = (time - stamp).seconds();
    const Vec3 position = p_odom + v_odom_m_s * dt_s;
    if (!attitude)
      return SE3(rotation_from_roll_pitch_yaw({0, 0, yaw_rad + yaw_rate_rad_s * dt_s}), position);
    const auto R_world_base = attitude->at(time);
    if (!R_world_base) return std::nullopt;
    return SE3(rotation_from_roll_pitch_yaw({0, 0, yaw_rad - attitude_yaw_rad}) * *R_world_base, position);
  }
};

}  // namespace hm
