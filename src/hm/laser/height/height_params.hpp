#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// Everything about height from mirrored beams (dissertation 2.2.3).
struct HeightParams {
  double bin_size_m = 0.02;
  int min_readings = 5;
  double reading_std_m = 0.01;
  double mode_half_width_sigmas_ratio = 4.0;
  double max_spread_sigmas_ratio = 1.9;
  double min_explained_ratio = 0.65;
  double doubtful_height_std_m = 0.03;
  double level_std_m = 0.002;
  double max_tilt_rad = 0.6;

  double min_step_m = 0.03;
  double step_sigmas_ratio = 3.0;
  int confirm_sightings = 3;
  int forget_unseen_scans = 10;
  double acceleration_density_m_s2_sqrt_hz = 0.4;
  double initial_climb_std_m_s = 1.0;

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
  [[nodiscard]] double mode_half_width_m() const { return mode_half_width_sigmas_ratio * reading_std_m; }
  /// A mode whose readings spread more is no surface, metres. Readings without any mode, spread evenly,
  /// have half_width / sqrt(3): the gate fires for those as long as it is below that.
  [[nodiscard]] double max_spread_m() const { return max_spread_sigmas_ratio * reading_std_m; }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"bin_size_m", {0.002, 0.5}, "width of the window whose fullest place is the mode"},
      self.bin_size_m);
    v(ParamDoc{"min_readings", {1, 1000}, "a mode with fewer readings is no surface"}, self.min_readings);
    v(ParamDoc{"reading_std_m", {0.0005, 0.2}, "noise of one reading"}, self.reading_std_m);
    v(ParamDoc{"mode_half_width_sigmas_ratio", {2, 20}, "readings this near to a mode belong to it"},
      self.mode_half_width_sigmas_ratio);
    v(ParamDoc{"max_spread_sigmas_ratio",
               {0.5, 20},
               "a mode that spreads more is no surface; above 0.57 of the half width it never fires"},
      self.max_spread_sigmas_ratio);
    v(ParamDoc{"min_explained_ratio",
               {0, 1},
               "scans with a smaller share of readings on surfaces are edges: no answer"},
      self.min_explained_ratio);
    v(ParamDoc{"doubtful_height_std_m", {0.001, 10}, "unless the height has become less certain than this"},
      self.doubtful_height_std_m);
    v(ParamDoc{"level_std_m", {0, 0.1}, "error that all readings of a scan have in common"},
      self.level_std_m);
    v(ParamDoc{"max_tilt_rad", {0.05, 1.5}, "no answer when the vehicle is tilted more"}, self.max_tilt_rad);
    v(ParamDoc{"min_step_m", {0.005, 1}, "surfaces nearer to each other than this are one floor"},
      self.min_step_m);
    v(ParamDoc{"step_sigmas_ratio", {2, 20}, "a step is beyond this many sigmas of the predicted height too"},
      self.step_sigmas_ratio);
    v(ParamDoc{"confirm_sightings", {1, 100}, "scans that must see a level before it is a floor"},
      self.confirm_sightings);
    v(
        ParamDoc{
            "forget_unseen_scans", {1, 1000}, "a level not yet confirmed is dropped after this many scans"},
        self.forget_unseen_scans);
    v(ParamDoc{"acceleration_density_m_s2_sqrt_hz",
               {0.001, 100},
               "unknown vertical acceleration, (m/s^2)/sqrt(Hz)"},
      self.acceleration_density_m_s2_sqrt_hz);
    v(ParamDoc{"initial_climb_std_m_s", {0.01, 20}, "climb rate at the first reading"},
      self.initial_climb_std_m_s);
  }
};

}  // namespace hm
