#include "hm/pipeline/flight/flight_run_params.hpp"

#include <iterator>

namespace hm {
namespace {

void add_core(ParamList& list, AutopilotParams& core) {
  list.add("autopilot", core);
  list.add("guidance", core.guidance);
  list.add("commands", core.commands);
  list.add("fail_safes", core.fail_safes);
  list.add("cascade", core.cascade);
  list.add("shaper", core.cascade.shaper);
  list.add("position_control", core.cascade.position);
  list.add("attitude_control", core.cascade.attitude);
  list.add("quadrotor", core.vehicle);
}

}  // namespace

void start_in(WorldKind world, FlightRunSettings& run) {
  struct Place {
    double x_m, y_m;
  };
  constexpr Place kPlaces[] = {{3, 7.5}, {1.2, 0.2}, {1.5, 0}};  // in the order of WorldKind
  static_assert(std::size(kPlaces) == std::size(kWorldKindNames));
  run.world = world;
  run.start_x_m = kPlaces[static_cast<std::size_t>(world)].x_m;
  run.start_y_m = kPlaces[static_cast<std::size_t>(world)].y_m;
}

FlightRunParams::FlightRunParams() {
  imu.imu_rate_hz = 1000;
  imu.imu_orientation = false;  // roll and pitch are the core's own
}

ParamList list_flight(FlightRunParams& parameters) {
  ParamList list;
  list.add("flight", parameters.run);
  list.add("vehicle", parameters.vehicle);
  list.add("laser_link", parameters.links.laser);
  add_core(list, parameters.autopilot);
  return list;
}

Result<void> check_default_core(FlightRunParams parameters) {
  match_inner_loop(parameters.autopilot.cascade, parameters.vehicle.inner_loop);
  AutopilotParams standard;
  ParamList wanted, used;
  add_core(wanted, standard);
  add_core(used, parameters.autopilot);
  for (std::size_t i = 0; i < used.all().size(); ++i) {
    const ParamRef &is = used.all()[i], &should = wanted.all()[i];
    if (value_text(is) != value_text(should))
      return fail(ErrorCode::kUsage, is.name, "is {}, but the firmware flies with its default, {}",
                  value_text(is), value_text(should));
  }
  return {};
}

AutopilotParams core_aboard(const FlightRunParams& parameters, const LaserRig& rig) {
  AutopilotParams core = parameters.autopilot;
  core.imu.R_base_imu = rig.T_base_imu.rotation().cast<float>();
  core.imu.p_base_imu_m = rig.T_base_imu.translation().cast<float>();
  match_inner_loop(core.cascade, parameters.vehicle.inner_loop);
  return core;
}

void match_inner_loop(CascadeParams& cascade, const InnerLoopParams& inner_loop) {
  switch (inner_loop.inner_loop) {
    case InnerLoopKind::kMotors:
      cascade.output = CascadeOutputKind::kRotors;
      return;
    case InnerLoopKind::kSecondOrder:
      cascade.output = CascadeOutputKind::kAttitudeThrust;
      cascade.tilt_gain_ratio = 1;
      cascade.tilt_response_s = static_cast<float>(2 * InnerLoopParams::kAttitudeDamping_ratio /
                                                   InnerLoopParams::kAttitudeFrequency_rad_s);
      return;
    case InnerLoopKind::kFirstOrder:
      cascade.output = CascadeOutputKind::kAttitudeThrust;
      cascade.tilt_gain_ratio = static_cast<float>(inner_loop.attitude_gain);
      cascade.tilt_response_s = static_cast<float>(inner_loop.attitude_time_constant_s);
  }
}

}  // namespace hm
