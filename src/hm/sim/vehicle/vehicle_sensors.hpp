#pragma once
#include <numbers>
#include <optional>

#include "hm/geometry/trajectory.hpp"
#include "hm/sim/recording/laser_simulation.hpp"
#include "hm/sim/sensor/laser_sensor.hpp"
#include "hm/sim/vehicle/stream_link.hpp"
#include "hm/sim/vehicle/vehicle.hpp"

namespace hm {

/// Sensors of a simulated vehicle and the links that carry their messages.
struct VehicleSensorsSetup {
  LaserSensorParams laser;
  LaserSensorEffects laser_effects;
  StreamLinkParams laser_link = kLaserLink;
  StreamLinkParams imu_link{LaserSimulationParams::kImuLatency_s, LaserSimulationParams::kLatencyJitter_s};
  std::uint64_t seed = 1;
};

/// Laser with mirrors (city_flyer_rig) on a vehicle that flies freely through a world, in place of the
/// scripted path of LaserSimulation, whose types of messages it gives. Scans begin every 25 ms from the
/// vehicle's start; each is computed when its sweep is complete, from the vehicle's true poses at every
/// millisecond, and arrives with the latency of its link. The fault `laser_off` suppresses scans that are
/// complete while it is active, `sensor_turned` turns the laser. Keeps references: world and renderer must
/// outlive it.
class VehicleSensors {
 public:
  /// Yaw of the sensors in the vehicle during the fault `sensor_turned`.
  static constexpr double kFaultTurn_rad = std::numbers::pi / 2;

  VehicleSensors(const World& world, const Renderer& renderer, const VehicleSensorsSetup& setup);

  /// Follows the vehicle: called once before its first step, then after each step with the sample that it
  /// returned.
  void update(const Vehicle& vehicle, const std::optional<ImuSample>& imu = std::nullopt);
  /// Next scan or sample that has arrived by `now`; nothing when there is none.
  std::optional<Received<LaserScan>> next_scan(Time now);
  std::optional<Received<ImuSample>> next_imu(Time now);
  [[nodiscard]] const LaserRig& rig() const { return rig_; }

 private:
  void sense_laser(const Vehicle& vehicle);
  LaserRig rig_;
  LaserSensor laser_;
  std::uint64_t seed_;
  StreamLink<LaserScan> laser_link_;
  StreamLink<ImuSample> imu_link_;
  Trajectory poses_;  ///< since the beginning of the present sweep
  std::int64_t scans_ = 0;
  std::optional<Time> start_;
};

}  // namespace hm
