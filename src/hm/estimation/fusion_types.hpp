#pragma once
#include <cstddef>
#include <optional>

#include "hm/core/time.hpp"
#include "hm/geometry/se2.hpp"

namespace hm {

/// The vehicle in the plane, as scan matching sees it.
struct PlanarPose {
  Time stamp;  ///< when the laser was there, not when the answer arrived
  SE2 T_odom_base;
  std::optional<Mat3> covariance;  ///< of (x, y, yaw) in the axes of `odom`
};

/// The base over the reference floor.
struct HeightReading {
  Time stamp;
  double height_m = 0;
  std::optional<double> std_m;
};

/// What became of an input.
enum class FusionStatus {
  kOk,             ///< used
  kWaiting,        ///< newer than the IMU: kept until that gets there
  kStarted,        ///< the first of its kind: the filter starts from it
  kGap,            ///< used; the IMU was silent before it, and constant velocity bridged that
  kRejected,       ///< it contradicts the filter beyond the gate
  kRecovered,      ///< it contradicts, as many before it did: the filter started anew from it
  kTooOld,         ///< older than the history: ignored
  kFromFuture,     ///< newer than the IMU by more than is plausible: ignored
  kTimeBackwards,  ///< not later than the one before: ignored
  kInvalid,        ///< not finite, or a covariance that is none: ignored
};

/// What happened to one kind of measurement so far.
struct FusionCounts {
  std::size_t accepted = 0, rejected = 0, recovered = 0;
  std::size_t too_old = 0, from_future = 0, time_backwards = 0, invalid = 0;
};

/// The state of the vehicle (dissertation 2.2: position, angles, linear velocity) at one moment.
struct VehicleState {
  Time stamp;
  Vec3 position_m = Vec3::Zero();              ///< in `odom`; z above the reference floor
  Vec3 velocity_m_s = Vec3::Zero();            ///< in `odom`
  Vec3 roll_pitch_yaw_rad = Vec3::Zero();      ///< of R_odom_base
  Vec3 angular_velocity_rad_s = Vec3::Zero();  ///< in `base`
  bool planar_ready = false;                   ///< x, y, yaw and their rates mean something
  bool height_ready = false;                   ///< z and its rate do

  Mat2 planar_covariance = Mat2::Zero(), planar_velocity_covariance = Mat2::Zero();
  double height_variance = 0, climb_variance = 0, yaw_variance = 0;
  Vec3 acceleration_bias_m_s2 = Vec3::Zero();  ///< in the level frame of the base (x forward, z up)
  double yaw_rate_bias_rad_s = 0;

  [[nodiscard]] SE3 T_odom_base() const;
};

}  // namespace hm
