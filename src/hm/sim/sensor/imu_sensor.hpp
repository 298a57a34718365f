#pragma once
#include <vector>

#include "hm/core/params.hpp"
#include "hm/core/rng.hpp"
#include "hm/sensors/imu.hpp"
#include "hm/sim/motion/flight.hpp"

namespace hm {

/// Parameters of a small IMU as carried by quadrotors: white noise, random-walk biases, and an orientation
/// from its own filter.
struct ImuSensorParams {
  double imu_rate_hz = 200;
  /// White noise of the gyroscopes, (rad/s)/sqrt(Hz).
  static constexpr double kGyroDensity_rad_s_sqrt_hz = 2e-4;
  double gyro_bias_rad_s = 0.002;  ///< standard deviation of the gyroscopes' bias at the start
  /// Random walk of this bias, (rad/s^2)/sqrt(Hz).
  static constexpr double kGyroBiasWalk_rad_s2_sqrt_hz = 2e-5;
  /// White noise of the accelerometers, (m/s^2)/sqrt(Hz).
  static constexpr double kAccelDensity_m_s2_sqrt_hz = 2e-3;
  /// Standard deviation of the accelerometers' bias at the start.
  static constexpr double kAccelBias_m_s2 = 0.05;
  /// Random walk of this bias, (m/s^3)/sqrt(Hz).
  static constexpr double kAccelBiasWalk_m_s3_sqrt_hz = 1e-3;
  bool imu_orientation = true;  ///< the device reports its orientation
  /// Error of its roll and pitch, correlated over 10 s.
  static constexpr double kTiltSigma_rad = 0.005;
  /// Standard deviation of its constant yaw drift.
  static constexpr double kYawDrift_rad_s = 0.001;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"imu_rate_hz", {20, 1000}, "samples per second"}, self.imu_rate_hz);
  }
};

/// Enabled errors of the IMU.
struct ImuSensorEffects {
  bool imu_noise = true;
  bool imu_bias = true;
  bool orientation_error = true;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"imu_noise", {}, "white noise of gyroscopes and accelerometers"}, self.imu_noise);
    v(ParamDoc{"imu_bias", {}, "biases of gyroscopes and accelerometers"}, self.imu_bias);
    v(ParamDoc{"orientation_error", {}, "errors of the reported orientation"}, self.orientation_error);
  }
};

/// Measurements of an ideal IMU mounted at `T_base_imu`.
ImuSample exact_imu(const FlightState& state, const SE3& T_base_imu);

/// Adds errors to the samples of an ideal IMU, which are `1 / imu_rate_hz` apart. The noise of a sample is
/// the density over the sampling interval; the random numbers drawn do not depend on the enabled errors.
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
