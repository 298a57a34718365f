#pragma once
#include "hm/core/params.hpp"
#include "hm/evaluation/mesh_error.hpp"
#include "hm/evaluation/trajectory_error.hpp"
#include "hm/mapping/keyframes/keyframe_maps.hpp"
#include "hm/mapping/mapping_params.hpp"
#include "hm/mvog/mvog_params.hpp"
#include "hm/odometry/interface/odometry_params.hpp"
#include "hm/slam/rgbd/rgbd_loop_params.hpp"

namespace hm {

/// Everything that decides what the RGB-D system does, and how it is compared with the truth.
struct RgbdParameters : MappingParams {
  OdometryParams odometry;
  RgbdLoopParams loops;
  MvogParams mvog;  ///< of the occupancy map that keyframes make
  MeshErrorParams mesh_error;
  TrajectoryErrorParams trajectory_error;
};

/// The sections that decide what visual odometry does: odometry, odometry_features, odometry_tracker,
/// odometry_published, reconstruction (which frames are used), trajectory_error.
ParamList list_odometry(RgbdParameters& parameters);
/// Those that decide what the whole system does: those of a reconstruction, odometry, slam, places,
/// place_verifier, rgbd_loops, mvog, mesh_error, trajectory_error.
ParamList list_slam(RgbdParameters& parameters);

/// The parameters of the maps that are made of keyframes.
KeyframeMapParams keyframe_map_params(const RgbdParameters& parameters);

/// Reports all contradictions between parameters in one error; ranges are checked by ParamList::check().
Result<void> check_parameters(const RgbdParameters& parameters);

}  // namespace hm
