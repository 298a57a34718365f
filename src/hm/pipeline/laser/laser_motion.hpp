#pragma once
#include <deque>
#include <optional>
#include <utility>

#include "hm/estimation/vehicle_estimator.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/laser/height/mirror_distances.hpp"
#include "hm/laser/odometry/attitude_history.hpp"
#include "hm/laser/odometry/scan_odometry.hpp"
#include "hm/laser/odometry/wheel_delay.hpp"

namespace hm {

/// The vehicle's motion around a scan, from IMU and odometry of a recording.
class LaserMotion {
 public:
  LaserMotion(const StateEstimatorParams& params, const SE3& T_base_imu, Duration max_odometry_gap);

  /// Takes a sample into the fusion and the history of attitudes.
  void add_imu(const ImuSample& sample);
  void add_odometry(const StampedPose& T_odom_base);

  [[nodiscard]] bool any_imu() const { return any_imu_; }
  /// True when the inputs given so far reach `stamp`.
  [[nodiscard]] bool imu_reaches(Time stamp) const { return any_imu_ && newest_imu_ >= stamp; }
  [[nodiscard]] bool odometry_reaches(Time stamp) const;

  /// Null without an IMU.
  [[nodiscard]] const AttitudeHistory* attitude() const { return any_imu_ ? &attitude_ : nullptr; }
  /// Level when there is no IMU, or where it is silent.
  [[nodiscard]] SweepAttitude sweep_attitude(Time begin, Time end) const;
  /// Mean upward acceleration (m/s^2, without gravity) between two moments, as the IMU measured it; nothing
  /// where it does not reach, or what it measures is no acceleration with gravity.
  [[nodiscard]] std::optional<double> upward_acceleration(Time begin, Time end) const;
  /// Where the odometry was when a scan with this stamp was measured: earlier by odometry_delay().
  [[nodiscard]] std::optional<SE3> odometry_at(Time stamp) const;
  /// Velocity vx, vy (m/s) and yaw rate (rad/s) in the base frame, as odometry that is read often measured it
  /// between these moments; nothing where it jumped.
  [[nodiscard]] std::optional<Vec3> odometry_velocity(Time begin, Time end) const;
  [[nodiscard]] Duration odometry_delay() const { return delay_.delay(); }

  /// The motion since the last remember(); without that of the odometry where it jumped since.
  [[nodiscard]] MotionPrediction since_last(Time now) const;
  /// Takes note of a scan and, where it was matched for certain, of its heading: the delay of the odometry is
  /// learned from these.
  void remember(Time now, const std::optional<double>& heading_rad);

  [[nodiscard]] StateEstimator& estimator() { return estimator_; }

 private:
  [[nodiscard]] Mat3 R_world_base_of(const ImuSample& sample);
  void add_climb(const ImuSample& sample, const Mat3& R_world_base);
  [[nodiscard]] std::optional<double> climb_at(Time stamp) const;
  [[nodiscard]] bool odometry_jumped(Time begin, Time end) const;
  [[nodiscard]] std::optional<SE2> frequent_odometry_at(Time stamp) const;

  StateEstimator estimator_;
  SE3 T_base_imu_;
  Duration max_odometry_gap_;
  AttitudeHistory attitude_;
  bool any_imu_ = false;
  Time newest_imu_;
  std::deque<std::pair<Time, double>> climbs_;  // of the accelerometer alone: m/s since the first sample
  double yaw_rad_ = 0;  // of the gyroscope alone: continuous, whatever the fusion corrects
  Trajectory odometry_;
  /// Stamps of the readings before and after the last jumps.
  std::deque<std::pair<Time, Time>> jumps_;
  std::optional<Mat3> last_attitude_;
  std::optional<SE3> last_odometry_;
  std::optional<Time> last_;
  std::optional<double> last_heading_rad_;
  WheelDelay delay_;
};

}  // namespace hm
