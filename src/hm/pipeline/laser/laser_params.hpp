#pragma once
#include <array>

#include "hm/core/params.hpp"
#include "hm/estimation/vehicle_estimator.hpp"
#include "hm/evaluation/relation_error.hpp"
#include "hm/evaluation/trajectory_error.hpp"
#include "hm/laser/height/height_params.hpp"
#include "hm/laser/odometry/scan_odometry.hpp"
#include "hm/laser/odometry/scan_projection.hpp"
#include "hm/mvog/mvog_params.hpp"
#include "hm/sensors/wheel_odometry.hpp"
#include "hm/slam/laser/grid_localiser.hpp"
#include "hm/slam/laser/motion/motion_search.hpp"
#include "hm/slam/laser/scan_graph_params.hpp"

namespace hm {

/// Source of a laser run's poses. kAuto: scan matching when a laser of the recording scans
/// horizontally, else the recording's odometry.
enum class LaserPoseSource { kAuto, kScans, kOdometry };
inline constexpr std::array<std::string_view, 3> kLaserPoseSourceNames{"auto", "scans", "odometry"};

/// Settings of a run through the laser system; the other sections decide what is computed.
struct LaserRunParams {
  LaserPoseSource poses = LaserPoseSource::kAuto;
  bool use_imu = true;
  bool use_odometry = true;
  bool degraded_odometry = false;
  bool search_motion = true;
  double search_gap_s = 1.0;
  bool close_loops = true;
  /// --localise: a lost vehicle is searched for in the whole map this often.
  static constexpr double kSeekInterval_s = 0.5;
  /// Odometry further apart is not interpolated between.
  static constexpr double kMaxOdometryGap_s = 1.0;
  double max_wait_s = 0.25;
  double begin_s = 0;
  double duration_s = 0;
  int scan_stride = 1;
  int queue_scans = 2;
  double clear_without_return_m = 0;
  double slice_bottom_m = 0.3;
  double slice_top_m = 1.8;
  bool pictures = true;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"poses",
               {},
               "scan matching, the recording's odometry, or what suits the recording",
               ParamLevel::kBasic},
      self.poses, kLaserPoseSourceNames);
    v(ParamDoc{"use_imu",
               {},
               "attitude, yaw between scans and fusion from the IMU, where there is one",
               ParamLevel::kBasic},
      self.use_imu);
    v(ParamDoc{"use_odometry", {}, "predict scan matching with the recording's odometry, where there is one"},
      self.use_odometry);
    v(ParamDoc{"degraded_odometry",
               {},
               "instead of the recording's odometry: its true poses with the noise of [wheel_noise]"},
      self.degraded_odometry);
    v(
        ParamDoc{
            "search_motion",
            {},
            "search the last keyframes for the scan where a match fails, and along the walls of a corridor"},
        self.search_motion);
    v(ParamDoc{"search_gap_s",
               {0, 1e6},
               "scans further apart than this that no odometry predicts are searched for at once"},
      self.search_gap_s);
    v(
        ParamDoc{
            "close_loops", {}, "correct the drift of scan matching by places seen again", ParamLevel::kBasic},
        self.close_loops);
    v(ParamDoc{"max_wait_s", {0, 60}, "a scan waits this long for IMU and odometry of its time"},
      self.max_wait_s);
    v(ParamDoc{"begin_s", {0, 1e9}, "leave out so much of the recording's beginning", ParamLevel::kBasic},
      self.begin_s);
    v(ParamDoc{"duration_s", {0, 1e9}, "use so much of the recording; 0 for all", ParamLevel::kBasic},
      self.duration_s);
    v(ParamDoc{"scan_stride", {1, 1e6}, "use every n-th scan of a laser"}, self.scan_stride);
    v(ParamDoc{"queue_scans",
               {1, 1000},
               "live: of the scans that wait, more than these are dropped, oldest first"},
      self.queue_scans);
    v(ParamDoc{"clear_without_return_m",
               {0, 1000},
               "a beam without return makes space free up to here; 0: it is ignored (glass, black surfaces)"},
      self.clear_without_return_m);
    v(ParamDoc{"slice_bottom_m",
               {-1000, 1000},
               "map.pgm: lowest height; planar recordings: all heights",
               ParamLevel::kBasic},
      self.slice_bottom_m);
    v(ParamDoc{"slice_top_m", {-1000, 1000}, "map.pgm: greatest height", ParamLevel::kBasic},
      self.slice_top_m);
    v(ParamDoc{"pictures", {}, "draw figures of the map for the report", ParamLevel::kBasic}, self.pictures);
  }
};

/// Everything that decides what a laser run does.
struct LaserParameters {
  LaserRunParams run;
  ScanProjectionParams projection;
  ScanOdometryParams matcher;
  MotionSearchParams motion_search;
  ScanGraph2DParams loops;
  GridLocaliserParams localiser;
  WheelNoiseParams wheel_noise;
  HeightParams height;
  StateEstimatorParams state;
  MvogParams mvog;
};

/// Parameters of a run: the laser system, and how its result is compared with the truth.
struct LaserRunParameters {
  LaserParameters laser;
  TrajectoryErrorParams trajectory_error;
  RelationErrorParams relation_error;
};

/// The sections that decide what a laser run does: laser, scan_projection, pl_icp, motion_search,
/// laser_loops, localiser, wheel_noise, height, state, fusion, tilt, the filters as published (thesis,
/// pose_alpha_beta, height_alpha_beta), mvog, trajectory_error, relation_error.
ParamList list_laser(LaserRunParameters& parameters);

/// Reports all contradictions between parameters in one error; ranges are checked by ParamList::check().
Result<void> check_parameters(const LaserRunParameters& parameters);

}  // namespace hm
