#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// Parameters of height estimation from mirrored beams (dissertation 2.2.3).
struct HeightParams {
  /// Width of the sliding window for finding modes.
  static constexpr double kBinSize_m = 0.02;
  /// Minimum number of readings of a surface.
  int min_readings = 5;
  double reading_std_m = 0.01;
  /// Readings within this many standard deviations of a mode belong to it.
  static constexpr double kModeHalfWidthSigmasRatio = 4.0;
  /// Largest spread of a surface, in standard deviations of a reading; has no effect above 0.57 of the half
  /// width.
  static constexpr double kMaxSpreadSigmasRatio = 1.9;
  double min_explained_ratio = 0.65;
  /// min_explained_ratio is not applied when the standard deviation of the height exceeds this.
  static constexpr double kDoubtfulHeightStd_m = 0.03;
  /// Standard deviation of the error common to all readings of a scan.
  static constexpr double kLevelStd_m = 0.002;
  /// No result when the vehicle is tilted more.
  double max_tilt_rad = 0.6;

  double min_step_m = 0.03;
  /// A step must also exceed this many standard deviations of the predicted height.
  static constexpr double kStepSigmasRatio = 3.0;
  /// Number of scans that must observe a level to confirm it as a floor.
  int confirm_sightings = 3;
  /// Unconfirmed levels are dropped after this many scans without observation.
  static constexpr int kForgetUnseenScans = 10;
  double acceleration_density_m_s2_sqrt_hz = 0.4;
  /// Where an IMU measures the vertical acceleration: density of what it does not measure, small enough that
  /// a ramp underneath is no climb; its bias, and how that changes with temperature and the error of the
  /// attitude.
  static constexpr double kMeasuredDensity_m_s2_sqrt_hz = 0.005;
  static constexpr double kInitialBiasStd_m_s2 = 0.3, kBiasDensity_m_s2_sqrt_s = 0.005;
  /// Then a sighting deviates by so many standard deviations at most, and one of a level that is not
  /// confirmed yet has this one besides: it may be part of a ramp.
  static constexpr double kMostDeviationsRatio = 2, kRampStd_m = 0.1;
  /// Standard deviation of the climb rate at the first reading.
  static constexpr double kInitialClimbStd_m_s = 1.0;

  /// These parameters for single readings of a range sensor. New levels need more observations; since only
  /// one surface is observed at a time, an IMU's vertical acceleration matters more than with a mirror.
  [[nodiscard]] HeightParams for_range_sensor() const {
    HeightParams params = *this;
    params.min_readings = 1;
    params.confirm_sightings = 8;
    return params;
  }

  /// Readings within this distance of a mode belong to it, metres.
  [[nodiscard]] double mode_half_width_m() const { return kModeHalfWidthSigmasRatio * reading_std_m; }
  /// Largest standard deviation of the readings of a surface, metres. Uniformly distributed readings have
  /// half_width / sqrt(3) and are rejected as long as the limit is below that.
  [[nodiscard]] double max_spread_m() const { return kMaxSpreadSigmasRatio * reading_std_m; }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"reading_std_m",
               {0.0005, 0.2},
               "standard deviation of one reading; rather too large than too small"},
      self.reading_std_m);
    v(ParamDoc{"min_explained_ratio",
               {0, 1},
               "no result for scans with a smaller share of readings on surfaces (edges)"},
      self.min_explained_ratio);
    v(ParamDoc{"min_step_m",
               {0.005, 1},
               "surfaces closer to each other than this are one floor; smaller steps count as climb"},
      self.min_step_m);
    v(ParamDoc{"acceleration_density_m_s2_sqrt_hz",
               {0.001, 100},
               "density of the vertical acceleration without an IMU, (m/s^2)/sqrt(Hz); larger follows motion "
               "faster, with more noise"},
      self.acceleration_density_m_s2_sqrt_hz);
  }
};

}  // namespace hm
