#pragma once
#include <functional>
#include <numbers>

#include "hm/core/params.hpp"
#include "hm/core/rng.hpp"
#include "hm/sensors/laser_rig.hpp"
#include "hm/sensors/laser_scan.hpp"
#include "hm/sim/sensor/renderer.hpp"

namespace hm {

/// A scanning range finder like the dissertation's Hokuyo UTM-30LX: how it sweeps, and the size of its
/// errors.
struct LaserSensorParams {
  int beams = 1081;
  double field_of_view_rad = 1.5 * std::numbers::pi;
  /// Scans a second; a scan takes its share of a turn.
  static constexpr double kScanRate_hz = 40;
  double range_min_m = 0.1, range_max_m = 30;
  double range_sigma_m = 0.01;  ///< standard deviation up to 10 m
  /// Range noise beyond 10 m.
  static constexpr double kRangeSigmaFar_m = 0.03;
  /// Ranges are rounded to multiples of this.
  static constexpr double kRangeStep_m = 0.001;
  /// Diameter of a beam's cone.
  static constexpr double kBeamWidth_rad = 0.008;
  /// Surfaces further apart than this in one beam are an edge.
  static constexpr double kEdgeStep_m = 0.03;
  /// Echoes closer together than this become one reading.
  static constexpr double kMixingDistance_m = 1.5;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"beams", {64, 10000}, "beams of a scan"}, self.beams);
    v(ParamDoc{"field_of_view_rad", {0.1, 6.28}, "from the first beam to the last"}, self.field_of_view_rad);
    v(ParamDoc{"range_min_m", {0, 10}, "nothing nearer is measured"}, self.range_min_m);
    v(ParamDoc{"range_max_m", {0.1, 1000}, "nothing further is measured"}, self.range_max_m);
    v(ParamDoc{"range_sigma_m", {0, 1}, "range noise up to 10 m"}, self.range_sigma_m);
  }
};

/// Which errors the laser makes.
struct LaserSensorEffects {
  bool range_noise = true;
  bool range_rounding = true;
  bool mixed_readings = true;    ///< beams have a width: at edges they read between two surfaces
  bool material_dropout = true;  ///< glass lets through; mirrors and black surfaces give nothing
  bool rolling_sweep = true;     ///< beams are measured one after another while the vehicle moves

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"range_noise", {}, "noise of the ranges"}, self.range_noise);
    v(ParamDoc{"range_rounding", {}, "ranges are rounded as in the device"}, self.range_rounding);
    v(ParamDoc{"mixed_readings", {}, "at edges a beam reads between two surfaces"}, self.mixed_readings);
    v(ParamDoc{"material_dropout", {}, "glass lets beams through, mirrors and black surfaces give nothing"},
      self.material_dropout);
    v(ParamDoc{"rolling_sweep", {}, "beams are measured one after another while the vehicle moves"},
      self.rolling_sweep);
  }
};

/// The rig of the dissertation's City Flyer (configs/city_flyer_rig.toml) for a laser with this many beams:
/// 20 beams down | 36 hidden | horizontal | 36 hidden | 20 beams up.
LaserRig city_flyer_rig(std::size_t beams);

/// Reads ranges from a world as a laser on a moving vehicle would. Immutable: may be used from several
/// threads. Keeps references: world and renderer must outlive it.
class LaserSensor {
 public:
  struct Setup {
    LaserSensorParams params;
    LaserSensorEffects effects;
    LaserRig rig;
  };
  LaserSensor(const World& world, const Renderer& renderer, const Setup& setup);

  /// The vehicle's pose T_world_base, this long after the first beam.
  using PoseAfter = std::function<SE3(double elapsed_s)>;

  /// A scan whose first beam is measured at `stamp`. Takes the same numbers from `rng` whatever is switched
  /// on. Beams that the rig hides are kInvalid, readings nearer than range_min_m as well.
  [[nodiscard]] LaserScan scan(Time stamp, const PoseAfter& T_world_base, Rng rng) const;
  /// From the first beam to the last; 0 without rolling sweep.
  [[nodiscard]] double sweep_s() const;

 private:
  /// The frames of a beam: that of the laser, or the virtual one behind a mirror; none when it is hidden.
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
