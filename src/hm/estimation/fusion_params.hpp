#pragma once
#include "hm/core/param_doc.hpp"

namespace hm {

/// Parameters of the delay-aware filters. Densities are one-sided amplitude densities as on a data sheet.
template <class Scalar>
struct BasicFusionParams {
  Scalar acceleration_density_m_s2_sqrt_hz = Scalar(0.05);
  /// The same when the IMU provides no orientation.
  static constexpr Scalar kOwnTiltAccelerationDensity_m_s2_sqrt_hz = Scalar(0.3);
  /// Random walk of the accelerometer bias, (m/s^3)/sqrt(Hz).
  static constexpr Scalar kAccelerationBiasWalk_m_s3_sqrt_hz = Scalar(0.005);
  /// Noise density of the gyroscope, (rad/s)/sqrt(Hz).
  static constexpr Scalar kYawRateDensity_rad_s_sqrt_hz = Scalar(0.002);
  /// Random walk of the gyroscope bias, (rad/s^2)/sqrt(Hz).
  static constexpr Scalar kYawRateBiasWalk_rad_s2_sqrt_hz = Scalar(0.0002);
  /// Density of unmeasured acceleration without IMU data.
  static constexpr Scalar kGapAccelerationDensity_m_s2_sqrt_hz = Scalar(2.0);
  /// Density of unmeasured yaw rate without IMU data.
  static constexpr Scalar kGapYawRateDensity_rad_s_sqrt_hz = Scalar(0.5);
  /// Standard deviation of the velocity at the first pose.
  static constexpr Scalar kInitialSpeedStd_m_s = Scalar(1.0);
  /// Standard deviation of the accelerometer bias at the first pose.
  static constexpr Scalar kInitialAccelerationBiasStd_m_s2 = Scalar(0.3);
  /// Standard deviation of the gyroscope bias at the first pose.
  static constexpr Scalar kInitialYawRateBiasStd_rad_s = Scalar(0.05);

  Scalar position_std_m = Scalar(0.02);
  Scalar yaw_std_rad = Scalar(0.01);
  Scalar height_std_m = Scalar(0.01);
  /// Added to the matcher's covariance, which models only range noise.
  Scalar added_position_std_m = Scalar(0.003);
  Scalar added_yaw_std_rad = Scalar(0.001);  ///< added to the matcher's covariance of yaw
  Scalar pose_gate_chi2 = Scalar(16.3);
  /// Heights beyond this are rejected (chi-squared, 1 degree of freedom; 10.8: one in 1000); larger rejects
  /// fewer.
  Scalar height_gate_chi2 = Scalar(10.8);
  /// Number of consecutive rejections after which the filter restarts from the next measurement.
  int recover_after_rejections = 20;

  bool delay_compensation = true;
  Scalar max_delay_s = Scalar(0.2);
  /// Measurements newer than the IMU by more are rejected.
  static constexpr Scalar kMaxLead_s = Scalar(0.05);
  /// Longer gaps in the IMU data are bridged with constant velocity.
  static constexpr Scalar kMaxGap_s = Scalar(0.1);

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"acceleration_density_m_s2_sqrt_hz",
               {1e-5, 100},
               "accelerometer noise density including tilt errors, (m/s^2)/sqrt(Hz); larger trusts the laser "
               "more"},
      self.acceleration_density_m_s2_sqrt_hz);
    v(ParamDoc{"position_std_m", {1e-4, 10}, "standard deviation of a laser pose without covariance"},
      self.position_std_m);
    v(ParamDoc{"yaw_std_rad", {1e-5, 3}, "standard deviation of the yaw of a laser pose without covariance"},
      self.yaw_std_rad);
    v(ParamDoc{"height_std_m", {1e-4, 10}, "standard deviation of a height without one"}, self.height_std_m);
    v(ParamDoc{"added_position_std_m",
               {0, 1},
               "added to the matcher's covariance, which models only range noise"},
      self.added_position_std_m);
    v(ParamDoc{"pose_gate_chi2",
               {1, 1e9},
               "poses beyond this are rejected (chi-squared, 3 degrees of freedom; 16.3: one in 1000); "
               "larger rejects fewer"},
      self.pose_gate_chi2);
    v(ParamDoc{"delay_compensation", {}, "apply measurements at their own time instead of on arrival"},
      self.delay_compensation);
    v(ParamDoc{"max_delay_s", {0, 1}, "older measurements are rejected"}, self.max_delay_s);
  }
};
using FusionParams = BasicFusionParams<double>;

}  // namespace hm
