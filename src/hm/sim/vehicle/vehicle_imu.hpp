#pragma once
#include <array>
#include <optional>

#include "hm/sim/sensor/imu_sensor.hpp"
#include "hm/sim/vehicle/rotors.hpp"

namespace hm {

/// Second-order low-pass filter of Butterworth type for six channels, discretised at 1 kHz by the bilinear
/// transform with the cut-off frequency kept. Begins in equilibrium with its first input.
class ImuLowPass {
 public:
  explicit ImuLowPass(double cut_off_hz);
  Vec6 filter(const Vec6& input);

 private:
  double b0_ = 0, a1_ = 0, a2_ = 0;
  std::optional<Vec6> in_1_;
  Vec6 in_2_ = Vec6::Zero(), out_1_ = Vec6::Zero(), out_2_ = Vec6::Zero();
};

/// Vibration of the rotors as an IMU feels it: of each rotor a line at its frequency and one at twice this
/// frequency, with fixed random directions and phases and amplitudes proportional to the squared speed.
class RotorVibration {
 public:
  RotorVibration(const VibrationParams& params, double hover_speed_rad_s, std::uint64_t seed);
  /// Vibration after a step with these rotor speeds: angular velocity (rad/s), then specific force (m/s^2),
  /// IMU frame.
  Vec6 next(const RotorValues& rotor_speed_rad_s, double step_s);

 private:
  static constexpr std::size_t kLines = 2;
  struct Line {
    Vec6 amplitude = Vec6::Zero();  ///< at the speed of hovering
    double phase_rad = 0;
  };
  double hover_speed_rad_s_;
  std::array<std::array<Line, kLines>, kRotors> lines_;
  std::array<double, kRotors> angle_rad_{};
};

/// Fixed description of a vehicle's IMU.
struct VehicleImuSetup {
  ImuSensorParams sensor;  ///< imu_rate_hz must divide 1000
  ImuSensorEffects effects;
  VibrationParams vibration;
  double hover_speed_rad_s = 583.5;
  SE3 T_base_imu;  ///< nominal mounting
  std::uint64_t seed = 1;
};

/// IMU of a simulated vehicle, stepped at 1 kHz: true rates and specific force at its place, vibration, the
/// low-pass filter of the device, sampling, then noise and biases (ImuErrors). Its true orientation differs
/// from the nominal one by VibrationParams::imu_misalignment_rad about a random axis.
class VehicleImu {
 public:
  explicit VehicleImu(const VehicleImuSetup& setup);
  /// Measurement at `now`, 1 ms after the last call; nothing between two samples.
  std::optional<ImuSample> step(Time now, const FlightState& motion, const RotorValues& rotor_speed_rad_s);
  /// True mounting.
  [[nodiscard]] const SE3& T_base_imu() const { return T_base_imu_; }

 private:
  SE3 T_base_imu_;
  RotorVibration vibration_;
  ImuLowPass low_pass_;
  ImuErrors errors_;
  int steps_per_sample_ = 1, step_ = 0;
};

}  // namespace hm
