#include "hm/pipeline/rgbd/rgbd_parameter_list.hpp"

#include "hm/pipeline/dense/dense_parameter_list.hpp"

namespace hm {
namespace {

void add_odometry(ParamList& list, OdometryParams& odometry) {
  list.add("odometry", odometry);
  list.add("odometry_features", odometry.features);
  list.add("odometry_tracker", odometry.tracker);
  list.add("odometry_published", odometry.published);
}

}  // namespace

ParamList list_odometry(RgbdParameters& parameters) {
  ParamList list;
  add_odometry(list, parameters.odometry);
  list.add("reconstruction", parameters.reconstruction);
  list.add("trajectory_error", parameters.trajectory_error);
  return list;
}

ParamList list_slam(RgbdParameters& parameters) {
  ParamList list = list_reconstruction(parameters);
  add_odometry(list, parameters.odometry);
  list.add("slam", parameters.slam);
  list.add("places", parameters.loops.search);
  list.add("place_verifier", parameters.loops.verifier);
  list.add("rgbd_loops", parameters.loops);
  list.add("mvog", parameters.mvog);
  list.add_renamed("keyframe_loops.link_visits", "rgbd_loops.match_covisible");
  list.add_renamed("keyframe_loops", "rgbd_loops");
  list.add("mesh_error", parameters.mesh_error);
  list.add("trajectory_error", parameters.trajectory_error);
  return list;
}

KeyframeMapParams keyframe_map_params(const RgbdParameters& parameters) {
  return {parameters.slam, parameters.mvog, parameters.depth_noise, parameters.odometry.max_depth_sigma_m,
          Vec3::UnitZ()};
}

Result<void> check_parameters(const RgbdParameters& parameters) {
  const DenseParams& dense = parameters;
  if (const auto checked = check_parameters(dense); !checked) return checked;
  if (const auto maps = map_kinds(parameters.slam); !maps) return forward_error(maps);
  if (const auto mvog = check_params(parameters.mvog); !mvog)
    return fail(ErrorCode::kUsage, "parameters", "{}", to_string(mvog.error()));
  return {};
}

}  // namespace hm
