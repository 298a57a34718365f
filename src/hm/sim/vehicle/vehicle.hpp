#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "hm/sim/vehicle/battery.hpp"
#include "hm/sim/vehicle/fault_script.hpp"
#include "hm/sim/vehicle/quadrotor_dynamics.hpp"
#include "hm/sim/vehicle/vehicle_contact.hpp"
#include "hm/sim/vehicle/vehicle_imu.hpp"
#include "hm/sim/vehicle/wind.hpp"

namespace hm {

/// Command to a simulated vehicle: rotor speeds with InnerLoopKind::kMotors, else an attitude and a thrust.
struct VehicleCommand {
  RotorValues rotor_speed_rad_s = RotorValues::Zero();
  InnerLoopCommand attitude;
};

/// Everything that determines a simulated vehicle.
struct VehicleSetup {
  VehicleParams params;
  ImuSensorParams imu;  ///< the constructor of VehicleSetup sets 1 kHz
  ImuSensorEffects imu_effects;
  SE3 T_base_imu;
  SE3 T_world_base{Mat3::Identity(), Vec3(0, 0, kBaseOverGround_m)};  ///< at the start, at rest
  Time start;
  FaultSchedule faults;
  std::uint64_t seed = 1;

  VehicleSetup() { imu.imu_rate_hz = 1000; }
};

/// Quadrotor with forces, rotors, battery, wind, contact and IMU, advanced in steps of 1 ms. The same setup,
/// surroundings and commands give the same bits, whatever else runs. Not thread safe: one thread at a time.
class Vehicle {
 public:
  static constexpr double kStep_s = 1e-3;
  static constexpr Duration kStep{1'000'000};
  /// Advance of the vehicle's clock during the fault `clock_step`.
  static constexpr Duration kFaultClockStep{500'000'000};

  Vehicle(const VehicleSetup& setup, CastRays surroundings);

  /// Applies a command for 1 ms. Returns the IMU's sample at the end of this step, stamped with the vehicle's
  /// clock; nothing between samples and during the fault `imu_gap`. A command with a number that is not
  /// finite is refused: the last one stays in force, and bad_commands() counts it.
  std::optional<ImuSample> step(const VehicleCommand& command);

  /// True time.
  [[nodiscard]] Time now() const { return now_; }
  /// Time since the start.
  [[nodiscard]] Duration elapsed() const { return now_ - setup_.start; }
  /// True motion of the base's origin.
  [[nodiscard]] const FlightState& state() const { return motion_; }
  [[nodiscard]] const RotorValues& rotor_speed_rad_s() const { return body_.rotor_speed_rad_s; }
  [[nodiscard]] const VehicleBattery& battery() const { return battery_; }
  [[nodiscard]] Vec3 wind_world_m_s() const { return wind_.velocity_world_m_s(); }
  [[nodiscard]] const std::vector<VehicleCollision>& collisions() const { return contact_.collisions(); }
  [[nodiscard]] int feet_down() const { return contact_.feet_down(); }
  [[nodiscard]] std::uint64_t bad_commands() const { return bad_commands_; }
  [[nodiscard]] const FaultSchedule& faults() const { return setup_.faults; }
  /// Whether a fault is active now.
  [[nodiscard]] bool has_fault(FaultKind kind) const { return setup_.faults.is_active(kind, elapsed()); }
  /// True mounting of the IMU, which differs from the nominal one.
  [[nodiscard]] const SE3& true_T_base_imu() const { return imu_.T_base_imu(); }

 private:
  void accept(const VehicleCommand& command);
  /// Rotor speeds that the motors strive for, given command, battery and faults.
  [[nodiscard]] RotorValues attainable_speeds() const;
  void update_inputs();
  std::optional<ImuSample> measure();

  VehicleSetup setup_;
  QuadrotorDynamics dynamics_;
  VehicleContact contact_;
  VehicleBattery battery_;
  WindModel wind_;
  ThrustErrors thrust_errors_;
  VehicleImu imu_;
  QuadrotorState body_;
  QuadrotorInputs inputs_;
  VehicleCommand command_;
  FlightState motion_;
  Time now_;
  std::int64_t steps_ = 0;
  std::optional<Duration> gust_at_;  ///< beginning of the last fault `gust`
  std::optional<ImuSample> last_sample_;
  std::uint64_t bad_commands_ = 0;
};

}  // namespace hm
