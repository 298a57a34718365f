#include "hm/pipeline/laser/laser_params.hpp"

namespace hm {

ParamList list_laser(LaserRunParameters& parameters) {
  LaserParameters& laser = parameters.laser;
  ParamList list;
  list.add("laser", laser.run);
  list.add("scan_projection", laser.projection);
  list.add("pl_icp", laser.matcher);
  list.add("motion_search", laser.motion_search);
  list.add("laser_loops", laser.loops);
  list.add("localiser", laser.localiser);
  list.add("wheel_noise", laser.wheel_noise);
  list.add("height", laser.height);
  list.add("state", laser.state);
  list.add("fusion", laser.state.fusion);
  list.add("tilt", laser.state.tilt);
  list.add("mvog", laser.mvog);
  list.add("trajectory_error", parameters.trajectory_error);
  list.add("relation_error", parameters.relation_error);
  list.add_renamed("matcher", "pl_icp");
  list.add_renamed("loops", "laser_loops");
  return list;
}

Result<void> check_parameters(const LaserRunParameters& parameters) {
  if (const auto mvog = check_params(parameters.laser.mvog); !mvog)
    return fail(ErrorCode::kUsage, "parameters", "{}", to_string(mvog.error()));
  if (parameters.laser.run.slice_top_m < parameters.laser.run.slice_bottom_m)
    return fail(ErrorCode::kUsage, "parameters", "laser.slice_top_m lies below laser.slice_bottom_m");
  return {};
}

}  // namespace hm
