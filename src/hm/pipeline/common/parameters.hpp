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
#include "hm/mesh/mesh_params.hpp"
#include "hm/odometry/interface/odometry_params.hpp"
#include "hm/pipeline/simulate/calibration_simulation.hpp"
#include "hm/pipeline/common/laser_params.hpp"
#include "hm/mapping/slam_params.hpp"
#include "hm/sensors/depth_noise.hpp"
#include "hm/sim/recording/laser_simulation.hpp"
#include "hm/sim/recording/simulation.hpp"
#include "hm/slam/rgbd/rgbd_loop_params.hpp"
#include "hm/tsdf/alignment/alignment_params.hpp"
#include "hm/tsdf/projection/tsdf_params.hpp"

namespace hm {

/// How a recording is run through the dense pipeline; what is computed is said by the other sections.
struct ReconstructionParams {
  int begin_frame = 0;
  int frame_limit = 0;
  int frame_stride = 1;
  int prefetch_frames = 4;
  bool align = false;
  bool live_mesh = true;
  double mesh_budget_ms = 15.0;
  double save_interval_s = 20.0;
  int save_interval_frames = 0;
  std::string mesh_formats = "ply,glb";
  bool pictures = true;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"begin_frame", {0, 1e9}, "first frame of the recording that is used"}, self.begin_frame);
    v(ParamDoc{"frame_limit", {0, 1e9}, "frames at most; 0 for all"}, self.frame_limit);
    v(ParamDoc{"frame_stride", {1, 1e6}, "use every n-th frame"}, self.frame_stride);
    v(ParamDoc{"prefetch_frames", {1, 1000}, "pictures decoded ahead"}, self.prefetch_frames);
    v(ParamDoc{"align", {}, "correct each given pose by aligning its depth picture to the map"}, self.align);
    v(ParamDoc{"live_mesh",
               {},
               "keep the mesh up to date while scanning; it is complete at the end in any case"},
      self.live_mesh);
    v(ParamDoc{"mesh_budget_ms", {0, 1e6}, "time for meshing after each frame; 0 for as long as it takes"},
      self.mesh_budget_ms);
    v(
        ParamDoc{
            "save_interval_s", {0, 1e6}, "the map is saved this often while running; 0 for only at the end"},
        self.save_interval_s);
    v(ParamDoc{"save_interval_frames", {0, 1e9}, "and after every so many frames; 0 for not"},
      self.save_interval_frames);
    v(ParamDoc{"mesh_formats", {}, "mesh files to write: any of ply, glb, obj, with commas between"},
      self.mesh_formats);
    v(ParamDoc{"pictures", {}, "draw pictures of the result for the report"}, self.pictures);
  }
};

/// Every parameter of the program, by section.
struct Parameters {
  TsdfParams tsdf;
  DepthNoise depth_noise;
  AlignmentParams alignment;
  MeshParams mesh;
  ReconstructionParams reconstruction;
  OdometryParams odometry;
  RgbdLoopParams loops;
  SlamParams slam;
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
/// The maps named in SlamParams::maps; an error names an unknown one.
Result<std::vector<std::string>> map_kinds(const SlamParams& params);
/// Those that decide what a laser run does: laser, scan_projection, matcher, height, state, fusion, tilt,
/// the filters as published (thesis, pose_alpha_beta, height_alpha_beta), mvog, and those of the comparison
/// with the truth.
ParamList list_laser(Parameters& parameters);
/// Those that a map was made with and cannot change later: tsdf (but for the memory cap and the kernel),
/// depth_noise, whether poses are aligned, and how. As "name = value" lines.
std::vector<std::string> map_parameters(const Parameters& parameters);

/// What contradicts, all of it in one error; ranges are checked by ParamList::check().
Result<void> check_parameters(const Parameters& parameters);

/// All parameters as a Markdown table for each section (docs/parameters.md).
std::string to_markdown(const ParamList& list);
/// One parameter in words: value, range or choices, help.
std::string explain(const ParamRef& param);

/// The formats named in ReconstructionParams::mesh_formats; an error names an unknown one.
Result<std::vector<std::string>> mesh_formats(const ReconstructionParams& params);

}  // namespace hm
