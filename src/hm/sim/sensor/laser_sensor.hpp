#pragma once
#include <functional>
#include <numbers>

#include "hm/core/params.hpp"
#include "hm/core/rng.hpp"
#include "hm/sensors/laser_rig.hpp"
#include "hm/sensors/laser_scan.hpp"
#include "hm/sim/sensor/renderer.hpp"

namespace hm {

/// Parameters of a scanning laser range finder like the dissertation's Hokuyo UTM-30LX, with the magnitude of
/// its errors.
struct LaserSensorParams {
  int beams = 1081;
  double field_of_view_rad = 1.5 * std::numbers::pi;
  /// Scans per second; a scan takes the share of a revolution given by the field of view.
  static constexpr double kScanRate_hz = 40;
  double range_min_m = 0.1, range_max_m = 30;
  double range_sigma_m = 0.01;  ///< standard deviation up to 10 m
  /// Range noise beyond 10 m.
  static constexpr double kRangeSigmaFar_m = 0.03;
  /// Ranges are rounded to multiples of this.
  static constexpr double kRangeStep_m = 0.001;
  /// Diameter of a beam's cone.
  static constexpr double kBeamWidth_rad = 0.008;
  /// Depth differences within one beam beyond this are an edge.
  static constexpr double kEdgeStep_m = 0.03;
  /// Echoes closer together than this become one reading.
  static constexpr double kMixingDistance_m = 1.5;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"beams", {64, 10000}, "number of beams of a scan"}, self.beams);
    v(ParamDoc{"field_of_view_rad", {0.1, 6.28}, "angle from the first beam to the last"},
      self.field_of_view_rad);
    v(ParamDoc{"range_min_m", {0, 10}, "minimum range"}, self.range_min_m);
    v(ParamDoc{"range_max_m", {0.1, 1000}, "maximum range"}, self.range_max_m);
    v(ParamDoc{"range_sigma_m", {0, 1}, "standard deviation of ranges up to 10 m"}, self.range_sigma_m);
  }
};

/// Enabled errors of the laser.
struct LaserSensorEffects {
  bool range_noise = true;
  bool range_rounding = true;
  bool mixed_readings = true;    ///< beams have a width: at edges ranges lie between two surfaces
  bool material_dropout = true;  ///< glass is transparent; mirrors and black surfaces give no return
  bool rolling_sweep = true;     ///< beams are measured one after another while the vehicle moves

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"range_noise", {}, "noise of the ranges"}, self.range_noise);
    v(ParamDoc{"range_rounding", {}, "ranges are quantised as in the device"}, self.range_rounding);
    v(ParamDoc{"mixed_readings", {}, "at edges a range lies between two surfaces"}, self.mixed_readings);
    v(ParamDoc{"material_dropout", {}, "glass is transparent; mirrors and black surfaces give no return"},
      self.material_dropout);
    v(ParamDoc{"rolling_sweep", {}, "beams are measured one after another while the vehicle moves"},
      self.rolling_sweep);
  }
};

/// Rig of the dissertation's City Flyer (configs/city_flyer_rig.toml) for a laser with this many beams: 20
/// beams down | 36 hidden | horizontal | 36 hidden | 20 beams up.
LaserRig city_flyer_rig(std::size_t beams);

/// Simulates the scans of a laser on a moving vehicle. Immutable, hence thread safe. Keeps references: world
/// and renderer must outlive it.
class LaserSensor {
 public:
  struct Setup {
    LaserSensorParams params;
    LaserSensorEffects effects;
    LaserRig rig;
  };
  LaserSensor(const World& world, const Renderer& renderer, const Setup& setup);

  /// Vehicle pose T_world_base at a time after the first beam.
  using PoseAfter = std::function<SE3(double elapsed_s)>;

  /// Simulates a scan whose first beam is measured at `stamp`. The random numbers drawn do not depend on the
  /// enabled effects. Beams hidden by the rig and ranges below range_min_m are kInvalid.
  [[nodiscard]] LaserScan scan(Time stamp, const PoseAfter& T_world_base, Rng rng) const;
  /// Time from the first beam to the last; 0 without rolling sweep.
  [[nodiscard]] double sweep_s() const;

 private:
  /// Frame of a beam in the base: the laser, or the virtual laser behind a mirror; null when the beam is
  /// hidden.
  [[nodiscard]] const SE3* mount_of(std::size_t beam) const;
  [[nodiscard]] std::size_t rays_per_beam() const;
  [[nodiscard]] std::vector<Ray> rays_of(const LaserScan& scan, const PoseAfter& T_world_base) const;
  [[nodiscard]] float sensed_m(double range_m, double noise) const;
  [[nodiscard]] std::vector<RayHit> cast(const std::vector<Ray>& rays) const;
  [[nodiscard]] double reading_m(std::span<const Ray> rays, std::span<const RayHit> hits) const;

  const World& world_;
  const Renderer& renderer_;
  Setup setup_;
};

}  // namespace hm
