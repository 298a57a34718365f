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

/// Everything that decides what a simulated flight looks like; the same values give the same bytes.
struct LaserSimulationParams {
  WorldKind world = WorldKind::kHouse;
  int seed = 1;
  int scan_limit = 0;  ///< 0: the whole flight
  FlightParams flight;
  LaserSensorParams laser;
  LaserSensorEffects laser_effects;
  ImuSensorParams imu;
  ImuSensorEffects imu_effects;
  bool latency = true;  ///< messages arrive later than they were measured
  /// From the last beam until a scan arrives.
  static constexpr double kScanLatency_s = 0.02;
  /// Until an IMU sample arrives.
  static constexpr double kImuLatency_s = 0.003;
  /// Added to both, evenly distributed from 0.
  static constexpr double kLatencyJitter_s = 0.004;
  double truth_rate_hz = 200;
  bool wheel_odometry = false;  ///< a planar odometry that drifts as one from wheels
  /// Its rate.
  static constexpr double kOdometryRate_hz = 20;
  double odometry_drift_ratio = 0.05;  ///< standard deviation of a metre that it measures
  double odometry_yaw_rad_m = 0.02;    ///< standard deviation of the yaw error after a metre

  /// A perfect vehicle: no errors and no latency; beams are still measured one after another.
  void make_perfect();

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"world", {}, "what is flown through", ParamLevel::kBasic}, self.world, kWorldKindNames);
    v(ParamDoc{"seed", {0, 2147483647}, "of all random numbers", ParamLevel::kBasic}, self.seed);
    v(ParamDoc{"scan_limit", {0, 1e9}, "scans at most (0: the whole flight)", ParamLevel::kBasic},
      self.scan_limit);
    FlightParams::visit(self.flight, v);
    LaserSensorParams::visit(self.laser, v);
    LaserSensorEffects::visit(self.laser_effects, v);
    ImuSensorParams::visit(self.imu, v);
    ImuSensorEffects::visit(self.imu_effects, v);
    v(ParamDoc{"latency", {}, "messages arrive later than they were measured"}, self.latency);
    v(ParamDoc{"truth_rate_hz", {100, 1000}, "poses of the truth a second"}, self.truth_rate_hz);
    v(ParamDoc{"wheel_odometry",
               {},
               "record a planar odometry that drifts as one from wheels",
               ParamLevel::kBasic},
      self.wheel_odometry);
    v(ParamDoc{"odometry_drift_ratio", {0, 1}, "standard deviation of a metre that it measures"},
      self.odometry_drift_ratio);
    v(ParamDoc{"odometry_yaw_rad_m", {0, 1}, "standard deviation of its yaw error after a metre"},
      self.odometry_yaw_rad_m);
  }
};

/// A measurement, and when it reached the recorder.
template <class T>
struct Received {
  Time at;
  T measured;
};

/// A planar odometry: pose in its own frame, velocities of the base.
struct WheelOdometry {
  StampedPose pose;
  Vec3 linear_velocity_base_m_s = Vec3::Zero();
  Vec3 angular_velocity_base_rad_s = Vec3::Zero();
};

/// The truth about heights: the reference is the world's floor, z = 0.
struct HeightTruth {
  Time stamp;
  double base_m = 0;     ///< of the base over the reference
  double floor_m = 0;    ///< of the surface straight below the base
  double ceiling_m = 0;  ///< of the surface straight above it; infinity: none
};

/// A quadrotor with a laser whose outer beams mirrors turn down and up, flown through a generated world
/// (dissertation 2.2). Everything may be asked for in any order and from several threads; it depends on the
/// parameters only.
class LaserSimulation {
 public:
  explicit LaserSimulation(const LaserSimulationParams& params);
  ~LaserSimulation();
  LaserSimulation(LaserSimulation&&) noexcept;
  LaserSimulation& operator=(LaserSimulation&&) noexcept;

  [[nodiscard]] std::size_t scan_count() const;
  [[nodiscard]] Received<LaserScan> scan(std::size_t index) const;
  [[nodiscard]] std::vector<Received<ImuSample>> imu() const;
  /// Empty unless params().wheel_odometry.
  [[nodiscard]] std::vector<Received<WheelOdometry>> odometry() const;
  /// From before the first beam to after the last.
  [[nodiscard]] Trajectory truth() const;
  [[nodiscard]] std::vector<HeightTruth> heights() const;

  /// The exact motion of the vehicle.
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
