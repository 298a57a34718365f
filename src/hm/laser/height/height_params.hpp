#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// Everything about height from mirrored beams (dissertation 2.2.3).
struct HeightParams {
  /// Width of the window whose fullest place is the mode.
  static constexpr double kBinSize_m = 0.02;
  /// A mode with fewer readings is no surface.
  int min_readings = 5;
  double reading_std_m = 0.01;
  /// Readings this near to a mode belong to it.
  static constexpr double kModeHalfWidthSigmasRatio = 4.0;
  /// A mode that spreads more is no surface; above 0.57 of the half width it never fires.
  static constexpr double kMaxSpreadSigmasRatio = 1.9;
  double min_explained_ratio = 0.65;
  /// Unless the height has become less certain than this.
  static constexpr double kDoubtfulHeightStd_m = 0.03;
  /// Error that all readings of a scan have in common.
  static constexpr double kLevelStd_m = 0.002;
  double max_tilt_rad = 0.6;

  double min_step_m = 0.03;
  /// A step is beyond this many sigmas of the predicted height too.
  static constexpr double kStepSigmasRatio = 3.0;
  /// Scans that must see a level before it is a floor.
  int confirm_sightings = 3;
  /// A level not yet confirmed is dropped after this many scans.
  static constexpr int kForgetUnseenScans = 10;
  double acceleration_density_m_s2_sqrt_hz = 0.4;
  /// Climb rate at the first reading.
  static constexpr double kInitialClimbStd_m_s = 1.0;

  /// For single readings of a distance sensor. What is new underneath must be seen more often to be accepted;
  /// as only one surface is seen at a time, an IMU's vertical acceleration matters more than with a mirror.
  static HeightParams for_range_sensor(double reading_std_m = 0.01) {
    HeightParams params;
    params.reading_std_m = reading_std_m;
    params.min_readings = 1;
    params.confirm_sightings = 8;
    return params;
  }

  /// Readings this near to a mode belong to it, metres.
  [[nodiscard]] double mode_half_width_m() const { return kModeHalfWidthSigmasRatio * reading_std_m; }
  /// A mode whose readings spread more is no surface, metres. Readings without any mode, spread evenly,
  /// have half_width / sqrt(3): the gate fires for those as long as it is below that.
  [[nodiscard]] double max_spread_m() const { return kMaxSpreadSigmasRatio * reading_std_m; }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"reading_std_m", {0.0005, 0.2}, "noise of one reading"}, self.reading_std_m);
    v(ParamDoc{"min_explained_ratio",
               {0, 1},
               "scans with a smaller share of readings on surfaces are edges: no answer"},
      self.min_explained_ratio);
    v(ParamDoc{"max_tilt_rad", {0.05, 1.5}, "no answer when the vehicle is tilted more"}, self.max_tilt_rad);
    v(ParamDoc{"min_step_m", {0.005, 1}, "surfaces nearer to each other than this are one floor"},
      self.min_step_m);
    v(ParamDoc{"acceleration_density_m_s2_sqrt_hz",
               {0.001, 100},
               "unknown vertical acceleration, (m/s^2)/sqrt(Hz)"},
      self.acceleration_density_m_s2_sqrt_hz);
  }
};

}  // namespace hm
