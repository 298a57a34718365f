#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/json_value.hpp"
#include "hm/core/run_context.hpp"
#include "hm/core/statistics.hpp"
#include "hm/evaluation/relation_error.hpp"
#include "hm/evaluation/trajectory_error.hpp"
#include "hm/io/laser/laser_recording.hpp"
#include "hm/pipeline/common/parameters.hpp"
#include "hm/pipeline/common/result_folder.hpp"
#include "hm/pipeline/laser/laser_map_summary.hpp"
#include "hm/pipeline/laser/laser_pipeline.hpp"

namespace hm {

/// As fast as it goes, or as the vehicle would: scans that come too fast are dropped, oldest first.
enum class LaserPace { kFast, kRealtime };

struct LaserRunOptions {
  std::filesystem::path recording;
  LaserRecordingOptions recording_options;
  std::filesystem::path output;  ///< a folder, made if needed
  ExistingResult existing = ExistingResult::kRefuse;
  std::filesystem::path relations;  ///< known relative poses to compare with; empty: none
  std::filesystem::path saved_map;  ///< find the vehicle in this map of an earlier run; empty: do not
  Parameters parameters;
  LaserPace pace = LaserPace::kFast;
  RunContext run;  ///< asked to stop, it finishes with what there is
};

/// One scan of a run: what it gave, and how large the map was then.
struct LaserScanRecord {
  LaserStep step;
  double time_s = 0;            ///< since the start of the recording
  std::optional<MvogSize> map;  ///< now and then
};

struct HeightError {
  double rmse_m = 0, max_m = 0;
  double offset_m =
      0;  ///< truth minus estimate, median; taken away first: the truth's zero is not the floor's
  std::size_t pairs = 0;
};

/// What a run gave.
struct LaserSummary {
  std::filesystem::path recording;
  std::string kind, laser;  ///< kind of recording; the laser whose scans were matched, or all that were used
  Parameters parameters;
  bool interrupted = false;
  LaserPace pace = LaserPace::kFast;
  bool matched_scans = false;
  bool planar = true;                ///< the map is one layer
  std::vector<std::string> choices;  ///< what was used of the recording, and why

  std::size_t scans_total = 0, scans_read = 0, scans_matched = 0, scans_failed = 0, keyframes = 0;
  std::size_t scans_searched = 0;  ///< sought among the last keyframes, for want of a good prediction
  std::size_t scans_found = 0;     ///< of these, with a pose from there, as matching gave none
  std::size_t restarts = 0;        ///< scan matching was lost, and began anew at a predicted pose
  std::size_t scans_dropped = 0;   ///< live: came too fast
  std::map<std::string, std::size_t> failure_reasons;
  std::vector<LaserScanRecord> records;  ///< of more than 262,144 scans an even thinning
  double run_s = 0, recording_s = 0;
  Summary match_ms, insert_ms;
  double insert_us_per_beam = 0;
  std::size_t beams = 0;  ///< that went into the map

  MvogSize mvog;
  Box3 bounds_m;
  std::vector<FloorLevel> floors;
  LaserMapSummary map_frame;
  Trajectory trajectory;  ///< T_map_base of the scans that have a pose, with all that is known at the end
  Trajectory trajectory_odom;  ///< T_odom_base of the same, never corrected
  Trajectory truth;            ///< T_world_base, of the recording
  std::string truth_source;
  std::optional<TrajectoryError> error;       ///< of `trajectory`
  std::optional<TrajectoryError> error_odom;  ///< of `trajectory_odom`, where it is another
  std::optional<HeightError> height_error;
  std::optional<RelationErrors> relation_error;       ///< of `trajectory`
  std::optional<RelationErrors> relation_error_odom;  ///< of `trajectory_odom`, where it is another
  std::vector<std::string> warnings;
  std::vector<std::filesystem::path> outputs;
};

/// A laser recording -> trajectory, height, floors, multi-volume map (dissertation 2.2, 2.5): writes
/// trajectory.txt, trajectory_odom.txt, map_frame.csv, height.csv, floors.csv, states.csv, map.mvog,
/// map.yaml, map.pgm, map.bt, map.ply, parameters.toml, report.json, report.html and pictures/.
///
/// Loops that close (or a saved map) say where the frame `odom` lies in `map`; trajectory.txt and the maps
/// are in `map`, made anew at the end from the recording's scans where that changes them.
///
/// Errors: recording, relations, saved map or output folder unusable, no scans in it, poses neither from
/// scans nor from odometry, nothing posed at all, a vehicle that was nowhere found in the saved map. A scan
/// that cannot be used is none: it is counted with its reason.
Result<LaserSummary> run_laser(const LaserRunOptions& options);

/// scans{read,matched,failed,keyframes}, match_ms{median,p99}, path_length_m ... (the keys of `hm laser
/// --json`).
JsonValue to_json(const LaserSummary& summary);
/// The same in a few lines for a terminal.
std::string to_text(const LaserSummary& summary);

}  // namespace hm
