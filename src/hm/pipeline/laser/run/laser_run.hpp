#pragma once
#include <filesystem>

#include "hm/core/run_context.hpp"
#include "hm/io/laser/laser_recording.hpp"
#include "hm/pipeline/common/result_folder.hpp"
#include "hm/pipeline/laser/run/laser_summary.hpp"

namespace hm {

struct LaserRunOptions {
  std::filesystem::path recording;
  LaserRecordingOptions recording_options;
  std::filesystem::path output;  ///< a folder, made if needed
  ExistingResult existing = ExistingResult::kRefuse;
  std::filesystem::path relations;  ///< known relative poses to compare with; empty: none
  std::filesystem::path saved_map;  ///< find the vehicle in this map of an earlier run; empty: do not
  LaserRunParameters parameters;
  LaserPace pace = LaserPace::kFast;
  bool force = false;  ///< runs even where the recording looks unusable (check_before_laser_run)
  /// Scans of which LaserSummary::records keeps all, about 300 MB; even. Of longer runs it keeps every 2nd,
  /// 4th ...
  std::size_t most_records = std::size_t{1} << 18u;
  RunContext run;  ///< stopped early, it finishes with what there is
};

/// A laser recording -> trajectory, height, floors, multi-volume map (dissertation 2.2, 2.5): writes
/// trajectory.tum, trajectory_odom.tum, map_frame.csv, height.csv, floors.csv, states.csv, map.mvog,
/// map.yaml, map.pgm, map.bt, map.ply, parameters.toml, report.json, report.html and pictures/.
///
/// Loops that close (or a saved map) say where the frame `odom` lies in `map`; trajectory.tum and the maps
/// are in `map`, made anew at the end from the recording's scans where that changes them.
///
/// Errors: recording, relations, saved map or output folder unusable (the recording also by
/// check_before_laser_run()), no scans in it, poses neither from
/// scans nor from odometry, nothing posed at all, a vehicle that was not found in the saved map. A scan
/// that cannot be used is none: it is counted with its reason.
Result<LaserSummary> run_laser(const LaserRunOptions& options);

}  // namespace hm
