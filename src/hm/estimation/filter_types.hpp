#pragma once
#include <cstddef>
#include <optional>

#include "hm/core/time.hpp"
#include "hm/estimation/filter_math.hpp"

namespace hm {

/// Planar pose of the vehicle from scan matching.
template <class Scalar>
struct PoseReading {
  Time stamp;                                         ///< time of measurement, not of arrival
  FilterVector<Scalar, 3> x_y_yaw;                    ///< of `base` in `odom`, metres and radians
  std::optional<FilterMatrix<Scalar, 3>> covariance;  ///< of (x, y, yaw) along the axes of `odom`
};

/// Height of the base above the reference floor.
template <class Scalar>
struct BasicHeightReading {
  Time stamp;
  Scalar height_m = 0;
  std::optional<Scalar> std_m;
};
using HeightReading = BasicHeightReading<double>;

/// One IMU measurement in the `imu` frame.
template <class Scalar>
struct InertialReading {
  Time stamp;
  FilterVector<Scalar, 3> angular_velocity_rad_s = FilterVector<Scalar, 3>::Zero();
  FilterVector<Scalar, 3> specific_force_m_s2 =
      FilterVector<Scalar, 3>::Zero();                 ///< (0, 0, +g) at rest, level
  std::optional<FilterMatrix<Scalar, 3>> R_world_imu;  ///< by the device's own filter, if it has one
};

/// Outcome of adding an input.
enum class FusionStatus : std::uint8_t {
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
template <class Scalar>
struct BasicVehicleState {
  using Vector3 = FilterVector<Scalar, 3>;
  using Matrix2 = FilterMatrix<Scalar, 2>;
  Time stamp;
  Vector3 position_m = Vector3::Zero();              ///< in `odom`; z above the reference floor
  Vector3 velocity_m_s = Vector3::Zero();            ///< in `odom`
  Vector3 roll_pitch_yaw_rad = Vector3::Zero();      ///< of R_odom_base
  Vector3 angular_velocity_rad_s = Vector3::Zero();  ///< in `base`
  bool planar_ready = false;                         ///< x, y, yaw and their rates are valid
  bool height_ready = false;                         ///< z and its rate are valid

  Matrix2 planar_covariance = Matrix2::Zero(), planar_velocity_covariance = Matrix2::Zero();
  Scalar height_variance = 0, climb_variance = 0, yaw_variance = 0;
  Vector3 acceleration_bias_m_s2 = Vector3::Zero();  ///< in the level frame of the base (x forward, z up)
  Scalar yaw_rate_bias_rad_s = 0;
};

}  // namespace hm
