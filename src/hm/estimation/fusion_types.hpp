#pragma once
#include <cstddef>
#include <optional>

#include "hm/core/time.hpp"
#include "hm/geometry/se2.hpp"

namespace hm {

/// Planar pose of the vehicle from scan matching.
struct PlanarPose {
  Time stamp;  ///< time of measurement, not of arrival
  SE2 T_odom_base;
  std::optional<Mat3> covariance;  ///< of (x, y, yaw) along the axes of `odom`
};

/// Height of the base above the reference floor.
struct HeightReading {
  Time stamp;
  double height_m = 0;
  std::optional<double> std_m;
};

/// Outcome of adding an input.
enum class FusionStatus {
  kOk,             ///< used
  kWaiting,        ///< newer than the IMU: kept until IMU data reaches it
  kStarted,        ///< first of its kind: initialised the filter
  kGap,            ///< used; the gap in the IMU data before it was bridged with constant velocity
  kRejected,       ///< inconsistent with the filter beyond the gate
  kRecovered,      ///< inconsistent, after many rejections: the filter restarted from it
  kTooOld,         ///< older than the history: ignored
  kFromFuture,     ///< newer than the IMU by more than is plausible: ignored
  kTimeBackwards,  ///< not later than the previous one: ignored
  kInvalid,        ///< not finite, or an invalid covariance: ignored
};

/// Outcomes of one kind of measurement so far.
struct FusionCounts {
  std::size_t accepted = 0, rejected = 0, recovered = 0;
  std::size_t too_old = 0, from_future = 0, time_backwards = 0, invalid = 0;
};

/// State of the vehicle at one time (dissertation 2.2: position, angles, linear velocity).
struct VehicleState {
  Time stamp;
  Vec3 position_m = Vec3::Zero();              ///< in `odom`; z above the reference floor
  Vec3 velocity_m_s = Vec3::Zero();            ///< in `odom`
  Vec3 roll_pitch_yaw_rad = Vec3::Zero();      ///< of R_odom_base
  Vec3 angular_velocity_rad_s = Vec3::Zero();  ///< in `base`
  bool planar_ready = false;                   ///< x, y, yaw and their rates are valid
  bool height_ready = false;                   ///< z and its rate are valid

  Mat2 planar_covariance = Mat2::Zero(), planar_velocity_covariance = Mat2::Zero();
  double height_variance = 0, climb_variance = 0, yaw_variance = 0;
  Vec3 acceleration_bias_m_s2 = Vec3::Zero();  ///< in the level frame of the base (x forward, z up)
  double yaw_rate_bias_rad_s = 0;

  [[nodiscard]] SE3 T_odom_base() const;
};

}  // namespace hm
