#pragma once
#include <string_view>

#include "hm/core/rng.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/sensors/depth_noise.hpp"
#include "hm/sensors/rgbd_frame.hpp"
#include "hm/sim/sensor/renderer.hpp"

namespace hm {

enum class SensorPreset { kTangoTablet, kTangoPhone, kKinect };
inline constexpr std::string_view kSensorPresetNames[] = {"tango_tablet", "tango_phone", "kinect"};

/// Model of a depth camera: optics, rate and magnitude of its errors, which are enabled by SensorEffects.
struct SensorModel {
  PinholeCamera camera;  ///< without distortion
  double rate_hz = 30;
  double min_depth_m = 0.4, max_depth_m = 5.0;
  DepthNoise noise;             ///< axial, on surfaces seen up to 60 degrees from their normal
  double lateral_sigma_px = 0;  ///< at depth edges
  double disparity_step_m = 0;  ///< 1/z is rounded to multiples of 1/disparity_step_m (0: no rounding)
  double bias_at_3m_m = 0;      ///< largest per-pixel bias at 3 m (quadratic in z)
  /// Readings are too short by this share at 1 m and right at 3 m, linearly in disparity: 1/z is read as
  /// (1 + 1.5 r)/z - 0.5 r.
  double short_at_1m_ratio = 0;
  /// Neighbouring readings err alike, as where each comes from a window of pixels: the axial noise of a
  /// reading is its own three times and that of 9 x 5 pixels around it once, scaled to the same sigma. So
  /// correlated are those of the Kinect of TUM fr1/xyz (0.77, 0.54 and 0.34 at 1, 3 and 5 columns, 0.68, 0.33
  /// and 0.08 at as many rows; first 1.8 s, walls).
  bool correlated_noise = false;
};
SensorModel sensor_model(SensorPreset preset);

/// Enabled errors of a simulated sensor, and parameters that do not depend on the device.
struct SensorEffects {
  bool axial_noise = true;
  bool lateral_noise = true;
  bool quantisation = true;
  bool depth_bias = true;        ///< tango_phone only
  bool grazing_dropout = true;   ///< no reading at grazing angles
  bool material_dropout = true;  ///< no reading from glass and black surfaces
  /// Factor on the axial noise.
  static constexpr double kNoiseScaleRatio = 1.0;
  double grazing_limit_rad = 1.36;  ///< 78 degrees from the surface normal

  /// Ideal sensor: readings limited only by range and rounding to `kSimulatedDepthUnit_m`.
  static SensorEffects none();

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"axial_noise", {}, "noise along the ray"}, self.axial_noise);
    v(ParamDoc{"lateral_noise", {}, "readings at edges come from a neighbouring pixel"}, self.lateral_noise);
    v(ParamDoc{"quantisation", {}, "disparity is quantised as in the device"}, self.quantisation);
    v(ParamDoc{"depth_bias", {}, "per-pixel quadratic depth bias (tango_phone)"}, self.depth_bias);
    v(ParamDoc{"grazing_dropout", {}, "no reading at grazing angles"}, self.grazing_dropout);
    v(ParamDoc{"material_dropout", {}, "no reading from glass and black surfaces"}, self.material_dropout);
  }
};

/// Unit of simulated depth images, as in the TUM format.
inline constexpr double kSimulatedDepthUnit_m = 1.0 / 5000.0;

/// Simulates a sensor's depth image of an ideal view. Readings are unbiased except for the bias model and
/// rounding. Axial: Nguyen et al. 2012, sigma(z) plus 1e-4/sqrt(z) theta^2/(pi/2-theta)^2 beyond 60 degrees.
/// Lateral: at a depth edge the reading is taken from a pixel at a normally distributed offset.
DepthImage sense_depth(const SensorModel& sensor, const SensorEffects& effects, const RenderedView& view,
                       Rng& rng);

/// Bias of a pixel at this true depth, metres: (a z^2 + b z) with a and b smooth over the image (dissertation
/// 4.1.3); its largest magnitude in the image at 3 m is sensor.bias_at_3m_m.
double depth_bias_m(const SensorModel& sensor, int x, int y, double depth_m);

}  // namespace hm
