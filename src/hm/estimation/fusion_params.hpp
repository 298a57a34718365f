#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// Parameters of the delay-aware filters. Densities are one-sided amplitude densities as on a data sheet.
struct FusionParams {
  double acceleration_density_m_s2_sqrt_hz = 0.05;
  /// Noise density of the acceleration when the IMU gives no orientation and TiltFilter estimates it,
  /// (m/s^2)/sqrt(Hz): errors of the tilt leak gravity into it.
  static constexpr double kOwnTiltAccelerationDensity_m_s2_sqrt_hz = 0.3;
  /// How fast its bias wanders, (m/s^3)/sqrt(Hz).
  static constexpr double kAccelerationBiasWalk_m_s3_sqrt_hz = 0.005;
  /// Noise of the gyroscope, (rad/s)/sqrt(Hz).
  static constexpr double kYawRateDensity_rad_s_sqrt_hz = 0.002;
  /// How fast its bias wanders, (rad/s^2)/sqrt(Hz).
  static constexpr double kYawRateBiasWalk_rad_s2_sqrt_hz = 0.0002;
  /// Unknown acceleration while there is no IMU.
  static constexpr double kGapAccelerationDensity_m_s2_sqrt_hz = 2.0;
  /// Unknown yaw rate while there is no IMU.
  static constexpr double kGapYawRateDensity_rad_s_sqrt_hz = 0.5;
  /// Velocity at the first pose.
  static constexpr double kInitialSpeedStd_m_s = 1.0;
  /// Bias of the accelerometer at the first pose.
  static constexpr double kInitialAccelerationBiasStd_m_s2 = 0.3;
  /// Bias of the gyroscope at the first pose.
  static constexpr double kInitialYawRateBiasStd_rad_s = 0.05;

  double position_std_m = 0.02;
  double yaw_std_rad = 0.01;
  double height_std_m = 0.01;
  double added_position_std_m = 0.003;
  double added_yaw_std_rad = 0.001;
  double pose_gate_chi2 = 16.3;
  double height_gate_chi2 = 10.8;
  int recover_after_rejections = 20;

  bool delay_compensation = true;
  double max_delay_s = 0.2;
  /// Measurements newer than the IMU by more are refused.
  static constexpr double kMaxLead_s = 0.05;
  double max_gap_s = 0.1;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"acceleration_density_m_s2_sqrt_hz",
               {1e-5, 100},
               "noise of the accelerometer, tilt errors included, (m/s^2)/sqrt(Hz)"},
      self.acceleration_density_m_s2_sqrt_hz);
    v(ParamDoc{"position_std_m", {1e-4, 10}, "of a laser pose that comes without covariance"},
      self.position_std_m);
    v(ParamDoc{"yaw_std_rad", {1e-5, 3}, "of its yaw"}, self.yaw_std_rad);
    v(ParamDoc{"height_std_m", {1e-4, 10}, "of a height that comes without one"}, self.height_std_m);
    v(ParamDoc{"added_position_std_m",
               {0, 1},
               "added to a matcher's covariance, which knows only the noise of ranges"},
      self.added_position_std_m);
    v(ParamDoc{"added_yaw_std_rad", {0, 1}, "the same for yaw"}, self.added_yaw_std_rad);
    v(ParamDoc{"pose_gate_chi2",
               {1, 1e9},
               "a pose beyond this is refused (3 degrees of freedom; 16.3: one in 1000)"},
      self.pose_gate_chi2);
    v(ParamDoc{"height_gate_chi2",
               {1, 1e9},
               "a height beyond this is refused (1 degree of freedom; 10.8: one in 1000)"},
      self.height_gate_chi2);
    v(ParamDoc{"recover_after_rejections",
               {1, 100000},
               "so many refusals on end, and the filter starts anew from the next"},
      self.recover_after_rejections);
    v(ParamDoc{"delay_compensation", {}, "apply measurements at their own time instead of on arrival"},
      self.delay_compensation);
    v(ParamDoc{"max_delay_s", {0, 1}, "measurements older than this are refused"}, self.max_delay_s);
    v(ParamDoc{"max_gap_s", {0.001, 10}, "a longer silence of the IMU is bridged with constant velocity"},
      self.max_gap_s);
  }
};

}  // namespace hm
