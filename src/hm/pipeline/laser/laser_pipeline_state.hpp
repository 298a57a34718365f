#pragma once
#include <deque>

#include "hm/pipeline/laser/laser_motion.hpp"
#include "hm/pipeline/laser/laser_pipeline.hpp"
#include "hm/pipeline/laser/matched_sweep.hpp"
#include "hm/slam/laser/motion_search.hpp"

namespace hm {

/// When the last beam of a scan has been measured.
inline Time end_of(const LaserScan& scan) { return scan.stamp_of(scan.size()); }

/// What a LaserPipeline is made of.
struct LaserPipeline::State {
  State(const LaserParameters& parameters, LaserPlatform of_vehicle, const OccupancyGrid2D* saved_map);
  void process_waiting(bool all);
  void process(const LaserScan& scan, LaserStep& step);
  void process_matched(const LaserScan& scan, LaserStep& step);
  void process_with_odometry(const LaserScan& scan, LaserStep& step);
  void estimate_height(const LaserScan& scan, LaserStep& step);
  ProjectedScan project(const LaserScan& scan, LaserStep& step);
  [[nodiscard]] MotionPrediction prediction_for(Time stamp);
  bool match(const PlanarScan& scan, LaserStep& step);
  void fuse(LaserStep& step);
  [[nodiscard]] MatchedSweep sweep_of(const LaserStep& step) const;
  void insert(const LaserScan& scan, LaserStep& step, const SweepPose& T_odom_base);
  [[nodiscard]] bool is_ready(const LaserScan& scan) const;
  [[nodiscard]] const LaserRig& rig() const { return platform.rigs.front(); }

  struct Waiting {
    LaserScan scan;
    std::size_t laser;
  };
  LaserParameters params;
  LaserPlatform platform;
  bool matches_scans, uses_imu, uses_odometry;
  LaserMotion motion;
  ScanProjector projector;
  ScanOdometry odometry;
  MotionSearch search;
  std::optional<Time> last_match;
  int scans_without_velocity = 0;  // so many more
  LaserMapFrame map_frame;
  HeightEstimator floor, ceiling;
  MultiVolumeGrid grid;
  SweepPoints points;
  std::vector<std::optional<Time>> last_stamps;  // of each laser
  std::optional<Time> newest_input;
  std::deque<Waiting> waiting;
  std::vector<LaserStep> steps;
};

}  // namespace hm
