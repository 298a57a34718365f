#pragma once
#include <string>
#include <vector>

#include "hm/calibration/board.hpp"
#include "hm/calibration/camera_fit.hpp"
#include "hm/calibration/depth_fit.hpp"
#include "hm/calibration/noise_fit.hpp"
#include "hm/calibration/stereo_fit.hpp"
#include "hm/core/params.hpp"
#include "hm/evaluation/mesh_error.hpp"
#include "hm/evaluation/relation_error.hpp"
#include "hm/evaluation/trajectory_error.hpp"
#include "hm/mapping/keyframe_maps.hpp"
#include "hm/mapping/mapping_params.hpp"
#include "hm/odometry/interface/odometry_params.hpp"
#include "hm/pipeline/simulate/calibration_simulation.hpp"
#include "hm/pipeline/common/laser_params.hpp"
#include "hm/sim/recording/laser_simulation.hpp"
#include "hm/sim/recording/simulation.hpp"
#include "hm/slam/rgbd/rgbd_loop_params.hpp"

namespace hm {

/// Every parameter of the program, by section.
struct Parameters : MappingParams {
  OdometryParams odometry;
  RgbdLoopParams loops;
  LaserParameters laser;
  SimulationParams simulation;
  LaserSimulationParams laser_simulation;
  BoardParams board;
  CameraFitParams camera_fit;
  StereoFitParams stereo_fit;
  DepthFitParams depth_fit;
  NoiseFitParams noise_fit;
  CalibrationSimulationParams calibration_simulation;
  MeshErrorParams mesh_error;
  TrajectoryErrorParams trajectory_error;
  RelationErrorParams relation_error;
};

/// References to all parameters, sections named as the members of Parameters (those of the laser system as in
/// list_laser).
ParamList list_all(Parameters& parameters);
/// Those that decide what a reconstruction looks like and how it is run: tsdf, depth_noise,
/// alignment, mesh, reconstruction.
ParamList list_reconstruction(Parameters& parameters);
/// Those that decide what visual odometry does: odometry, reconstruction (which frames are used),
/// trajectory_error.
ParamList list_odometry(Parameters& parameters);
/// Those that decide what the whole RGB-D system does: odometry, slam, places, place_verifier,
/// keyframe_loops, keyframe_solver, those of a reconstruction, mvog, mesh_error, trajectory_error.
ParamList list_slam(Parameters& parameters);
/// Those that decide what a laser run does: laser, scan_projection, matcher, height, state, fusion, tilt,
/// the filters as published (thesis, pose_alpha_beta, height_alpha_beta), mvog, and those of the comparison
/// with the truth.
ParamList list_laser(Parameters& parameters);
/// Those that a map was made with and cannot change later: tsdf (but for the memory cap and the kernel),
/// depth_noise, whether poses are aligned, and how. As "name = value" lines.
std::vector<std::string> map_parameters(const Parameters& parameters);

/// Those of the maps that are made of keyframes.
KeyframeMapParams keyframe_map_params(const Parameters& parameters);

/// Checks for contradictions, all of them in one error; ranges are checked by ParamList::check().
Result<void> check_parameters(const Parameters& parameters);

/// All parameters as a Markdown table for each section (docs/parameters.md).
std::string to_markdown(const ParamList& list);
/// One parameter in words: value, range or choices, help.
std::string explain(const ParamRef& param);

}  // namespace hm
