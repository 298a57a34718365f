#include "hm/pipeline/flight/flight_run_params.hpp"

#include <iterator>

namespace hm {
namespace {

void add_core(ParamList& list, AutopilotParams& core) {
  list.add("autopilot", core);
  list.add("state_machine", core.machine);
  list.add("touchdown", core.touchdown);
  list.add("flown_path", core.path);
  list.add("guidance", core.guidance);
  list.add("commands", core.commands);
  list.add("fail_safes", core.fail_safes);
  list.add("core_state", core.estimator);
  list.add("core_fusion", core.estimator.fusion);
  list.add("core_tilt", core.estimator.tilt);
  list.add("core_thesis", core.estimator.thesis);
  list.add("core_pose_alpha_beta", core.estimator.pose_alpha_beta);
  list.add("core_height_alpha_beta", core.estimator.height_alpha_beta);
  list.add("cascade", core.cascade);
  list.add("shaper", core.cascade.shaper);
  list.add("position_control", core.cascade.position);
  list.add("attitude_control", core.cascade.attitude);
  list.add("hover_thrust", core.cascade.hover);
  list.add("quadrotor", core.vehicle);
  list.add("published", core.published);
  list.add("published_position_xy", core.published.position_xy);
  list.add("published_velocity_x", core.published.velocity_x);
  list.add("published_velocity_y", core.published.velocity_y);
  list.add("published_position_z", core.published.position_z);
  list.add("published_velocity_z", core.published.velocity_z);
  list.add("published_yaw", core.published.yaw);
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
  list.add("laser_sensor", parameters.laser);
  list.add("laser_errors", parameters.laser_effects);
  list.add("imu_sensor", parameters.imu);
  list.add("imu_errors", parameters.imu_effects);
  list.add("laser_link", parameters.links.laser);
  list.add("serial_up", parameters.links.serial_up);
  list.add("serial_down", parameters.links.serial_down);
  list.add("motor_link", parameters.links.motors);
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
      cascade.tilt_response_s =
          static_cast<float>(2 * inner_loop.attitude_damping_ratio / inner_loop.attitude_frequency_rad_s);
      return;
    case InnerLoopKind::kFirstOrder:
      cascade.output = CascadeOutputKind::kAttitudeThrust;
      cascade.tilt_gain_ratio = static_cast<float>(inner_loop.attitude_gain);
      cascade.tilt_response_s = static_cast<float>(inner_loop.attitude_time_constant_s);
  }
}

}  // namespace hm
