#pragma once
#include "hm/core/params.hpp"
#include "hm/flight/autopilot.hpp"
#include "hm/pipeline/laser/laser_params.hpp"
#include "hm/sensors/laser_rig.hpp"
#include "hm/sim/sensor/imu_sensor.hpp"
#include "hm/sim/sensor/laser_sensor.hpp"
#include "hm/sim/vehicle/stream_link.hpp"
#include "hm/sim/vehicle/vehicle_params.hpp"
#include "hm/sim/world/world.hpp"

namespace hm {

/// Where a flight takes place, and what its on-board computer needs for its work.
struct FlightRunSettings {
  WorldKind world = WorldKind::kHouse;
  int seed = 1;
  double start_x_m = 3, start_y_m = 7.5;  ///< in the hallway of the house
  double start_yaw_rad = 0;
  /// Simulated time from the arrival of a scan to its pose.
  double perception_s = 0.005;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"world", {}, "world of the flight", ParamLevel::kBasic}, self.world, kWorldKindNames);
    v(ParamDoc{"seed", {0, 2147483647}, "seed of all random numbers", ParamLevel::kBasic}, self.seed);
    v(ParamDoc{"start_x_m", {-1000, 1000}, "where the vehicle stands at the start", ParamLevel::kBasic},
      self.start_x_m);
    v(ParamDoc{"start_y_m", {-1000, 1000}, "where the vehicle stands at the start", ParamLevel::kBasic},
      self.start_y_m);
    v(ParamDoc{"start_yaw_rad", {-3.1416, 3.1416}, "heading at the start", ParamLevel::kBasic},
      self.start_yaw_rad);
  }
};

/// Sets world and start: a place where a vehicle can stand in that world.
void start_in(WorldKind world, FlightRunSettings& run);

/// Links of a flying vehicle. Scans reach the computer by USB, poses and commands the board by the serial
/// line (460,800 baud, 8N1), and the same line brings IMU samples back.
struct FlightLinkParams {
  StreamLinkParams laser = kLaserLink, serial_up = kSerialLink, serial_down = kSerialLink,
                   motors = kCommandLink;
};

/// Everything that decides what a simulated flight is like.
struct FlightRunParams {
  FlightRunSettings run;
  VehicleParams vehicle;
  LaserSensorParams laser;
  LaserSensorEffects laser_effects;
  ImuSensorParams imu;  ///< the rate is 1 kHz whatever imu_rate_hz says
  ImuSensorEffects imu_effects;
  FlightLinkParams links;
  AutopilotParams autopilot;
  LaserParameters perception;

  FlightRunParams();
};

/// The sections of a flight: flight, vehicle, the laser's link, and those of the autopilot. The perception's
/// are list_laser()'s. The simulated laser and IMU, the autopilot's filters and the published law have none:
/// they are as the dissertation's vehicle had them.
ParamList list_flight(FlightRunParams& parameters);

/// Whether the core would fly with its default parameters, as the firmware does. Error (kUsage): which
/// section differs.
Result<void> check_default_core(FlightRunParams parameters);

/// The core's parameters aboard this vehicle: those given, with the mounting of its IMU and its inner loop.
AutopilotParams core_aboard(const FlightRunParams& parameters, const LaserRig& rig);

/// Sets what the core assumes of a vehicle with this inner loop: the kind of its output, and how fast and how
/// far tilt follows its command.
void match_inner_loop(CascadeParams& cascade, const InnerLoopParams& inner_loop);

}  // namespace hm
