#pragma once
#include <vector>

#include "hm/core/params.hpp"
#include "hm/core/rng.hpp"
#include "hm/sensors/imu.hpp"
#include "hm/sim/motion/flight.hpp"

namespace hm {

/// An inertial measurement unit of the size that small helicopters carry: white noise, biases that wander,
/// and an orientation by its own filter.
struct ImuSensorParams {
  double imu_rate_hz = 200;
  double gyro_density_rad_s_sqrt_hz = 2e-4;
  double gyro_bias_rad_s = 0.002;  ///< standard deviation at the start
  double gyro_bias_walk_rad_s2_sqrt_hz = 2e-5;
  double accel_density_m_s2_sqrt_hz = 2e-3;
  double accel_bias_m_s2 = 0.05;  ///< standard deviation at the start
  double accel_bias_walk_m_s3_sqrt_hz = 1e-3;
  bool imu_orientation = true;     ///< the device reports one
  double tilt_sigma_rad = 0.005;   ///< of its roll and pitch, changing slowly
  double yaw_drift_rad_s = 0.001;  ///< standard deviation of its constant yaw drift

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"imu_rate_hz", {20, 1000}, "samples a second"}, self.imu_rate_hz);
    v(ParamDoc{"gyro_density_rad_s_sqrt_hz", {0, 1}, "white noise of the gyros, (rad/s)/sqrt(Hz)"},
      self.gyro_density_rad_s_sqrt_hz);
    v(ParamDoc{"gyro_bias_rad_s", {0, 1}, "standard deviation of their bias at the start"},
      self.gyro_bias_rad_s);
    v(ParamDoc{"gyro_bias_walk_rad_s2_sqrt_hz", {0, 1}, "how fast it wanders, (rad/s^2)/sqrt(Hz)"},
      self.gyro_bias_walk_rad_s2_sqrt_hz);
    v(ParamDoc{"accel_density_m_s2_sqrt_hz", {0, 10}, "white noise of accelerometers, (m/s^2)/sqrt(Hz)"},
      self.accel_density_m_s2_sqrt_hz);
    v(ParamDoc{"accel_bias_m_s2", {0, 10}, "standard deviation of their bias at the start"},
      self.accel_bias_m_s2);
    v(ParamDoc{"accel_bias_walk_m_s3_sqrt_hz", {0, 10}, "how fast it wanders, (m/s^3)/sqrt(Hz)"},
      self.accel_bias_walk_m_s3_sqrt_hz);
    v(ParamDoc{"imu_orientation", {}, "the device reports an orientation by its own filter"},
      self.imu_orientation);
    v(ParamDoc{"tilt_sigma_rad", {0, 0.5}, "error of its roll and pitch, changing over 10 s"},
      self.tilt_sigma_rad);
    v(ParamDoc{"yaw_drift_rad_s", {0, 0.5}, "standard deviation of its constant yaw drift"},
      self.yaw_drift_rad_s);
  }
};

/// Which errors the inertial measurement unit makes.
struct ImuSensorEffects {
  bool imu_noise = true;
  bool imu_bias = true;
  bool orientation_error = true;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"imu_noise", {}, "white noise of gyros and accelerometers"}, self.imu_noise);
    v(ParamDoc{"imu_bias", {}, "biases of gyros and accelerometers"}, self.imu_bias);
    v(ParamDoc{"orientation_error", {}, "errors of the orientation that the device reports"},
      self.orientation_error);
  }
};

/// What an exact device would feel: `T_base_imu` says where it sits.
ImuSample exact_imu(const FlightState& state, const SE3& T_base_imu);

/// Adds the errors of a device to the samples of an exact one, which are `1 / imu_rate_hz` apart. The noise
/// of a sample is that of its density over the sampling interval; the same numbers are drawn whatever is
/// switched on.
class ImuErrors {
 public:
  ImuErrors(const ImuSensorParams& params, const ImuSensorEffects& effects, std::uint64_t seed);
  ImuSample next(const ImuSample& exact);

 private:
  Vec3 normal3(double sigma);

  ImuSensorParams params_;
  ImuSensorEffects effects_;
  Rng rng_;
  Vec3 gyro_bias_ = Vec3::Zero(), accel_bias_ = Vec3::Zero();
  Vec3 tilt_ = Vec3::Zero();
  double yaw_rate_ = 0, yaw_ = 0;
};

}  // namespace hm
