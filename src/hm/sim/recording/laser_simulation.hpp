#pragma once
#include <memory>
#include <vector>

#include "hm/core/params.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/sim/motion/flight.hpp"
#include "hm/sim/sensor/imu_sensor.hpp"
#include "hm/sim/sensor/laser_sensor.hpp"
#include "hm/sim/world/world.hpp"

namespace hm {

/// Parameters of a simulated flight; the same values give the same bytes.
struct LaserSimulationParams {
  WorldKind world = WorldKind::kHouse;
  int seed = 1;
  int scan_limit = 0;  ///< 0: the whole flight
  FlightParams flight;
  LaserSensorParams laser;
  LaserSensorEffects laser_effects;
  ImuSensorParams imu;
  ImuSensorEffects imu_effects;
  bool latency = true;  ///< messages arrive with a delay
  /// Delay from the last beam to the arrival of a scan.
  static constexpr double kScanLatency_s = 0.02;
  /// Delay of an IMU sample.
  static constexpr double kImuLatency_s = 0.003;
  /// Added to both, uniformly distributed from 0.
  static constexpr double kLatencyJitter_s = 0.004;
  double truth_rate_hz = 200;
  bool wheel_odometry = false;  ///< record planar odometry that drifts like wheel odometry
  /// Rate of the wheel odometry.
  static constexpr double kOdometryRate_hz = 20;
  double odometry_drift_ratio = 0.05;  ///< standard deviation of the measured distance per metre
  double odometry_yaw_rad_m = 0.02;    ///< standard deviation of the yaw error per metre

  /// Disables all errors and latency; beams are still measured one after another.
  void make_perfect();

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"world", {}, "world of the flight", ParamLevel::kBasic}, self.world, kWorldKindNames);
    v(ParamDoc{"seed", {0, 2147483647}, "seed of all random numbers", ParamLevel::kBasic}, self.seed);
    v(ParamDoc{"scan_limit", {0, 1e9}, "maximum number of scans; 0: the whole flight", ParamLevel::kBasic},
      self.scan_limit);
    FlightParams::visit(self.flight, v);
    LaserSensorParams::visit(self.laser, v);
    LaserSensorEffects::visit(self.laser_effects, v);
    ImuSensorParams::visit(self.imu, v);
    ImuSensorEffects::visit(self.imu_effects, v);
    v(ParamDoc{"latency", {}, "messages arrive with a delay"}, self.latency);
    v(ParamDoc{"truth_rate_hz", {100, 1000}, "rate of the true poses"}, self.truth_rate_hz);
    v(ParamDoc{"wheel_odometry",
               {},
               "record planar odometry that drifts like wheel odometry",
               ParamLevel::kBasic},
      self.wheel_odometry);
  }
};

/// Measurement with its time of arrival at the recorder.
template <class T>
struct Received {
  Time at;
  T measured;
};

/// Planar odometry: pose in its own frame, velocities in the base frame.
struct WheelOdometry {
  StampedPose pose;
  Vec3 linear_velocity_base_m_s = Vec3::Zero();
  Vec3 angular_velocity_base_rad_s = Vec3::Zero();
};

/// True heights; the reference is the world's floor, z = 0.
struct HeightTruth {
  Time stamp;
  double base_m = 0;     ///< of the base above the reference
  double floor_m = 0;    ///< of the surface vertically below the base
  double ceiling_m = 0;  ///< of the surface vertically above it; infinity: none
};

/// True heights of a base at this place.
HeightTruth true_heights(const Renderer& renderer, Time stamp, const Vec3& base_world);

/// Simulates the flight of a quadrotor through a generated world, with a laser whose outer beams are
/// deflected down and up by mirrors (dissertation 2.2). Const members may be called in any order and from
/// several threads; results depend only on the parameters.
class LaserSimulation {
 public:
  explicit LaserSimulation(const LaserSimulationParams& params);
  ~LaserSimulation();
  LaserSimulation(LaserSimulation&&) noexcept;
  LaserSimulation& operator=(LaserSimulation&&) noexcept;

  [[nodiscard]] std::size_t scan_count() const;
  [[nodiscard]] Received<LaserScan> scan(std::size_t index) const;
  [[nodiscard]] std::vector<Received<ImuSample>> imu() const;
  /// Wheel odometry; empty unless params().wheel_odometry.
  [[nodiscard]] std::vector<Received<WheelOdometry>> odometry() const;
  /// True poses, from before the first beam to after the last.
  [[nodiscard]] Trajectory truth() const;
  [[nodiscard]] std::vector<HeightTruth> heights() const;

  /// Exact motion of the vehicle.
  [[nodiscard]] FlightState state_at(Time time) const;
  [[nodiscard]] const LaserRig& rig() const;
  [[nodiscard]] const World& world() const;
  [[nodiscard]] const Renderer& renderer() const;
  [[nodiscard]] const LaserSimulationParams& params() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
