#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/core/statistics.hpp"
#include "hm/evaluation/relation_error.hpp"
#include "hm/evaluation/trajectory_error.hpp"
#include "hm/io/laser/laser_recording.hpp"
#include "hm/mvog/multi_volume_grid.hpp"
#include "hm/pipeline/common/parameters.hpp"
#include "hm/pipeline/laser/laser_map_frame.hpp"
#include "hm/pipeline/laser/laser_pipeline.hpp"
#include "hm/pipeline/verdict/run_verdict.hpp"
#include "hm/report/summary_tree.hpp"

namespace hm {

/// As fast as it goes, or as the vehicle would: scans that come too fast are dropped, oldest first.
enum class LaserPace { kFast, kRealtime };

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

/// Confidence in the vehicle's place in a saved map.
struct LocalisationSummary {
  /// A median score below this speaks of another place, or of a place that has changed.
  static constexpr double kSureScore = 0.8;
  std::filesystem::path map;
  std::size_t located = 0;   ///< scans whose place was found or followed
  std::size_t scans = 0;     ///< scans that were to be located
  std::size_t searches = 0;  ///< of these, in the whole map
  std::size_t found = 0, ambiguous = 0, not_found = 0, limit_reached = 0;  ///< what became of the searches
  std::size_t match_failed = 0, lost = 0, too_few_points = 0;
  std::optional<double> first_fix_s;  ///< since the start of the recording
  Summary score;                      ///< mean likelihood of the points, of the located scans
  /// Distance by which the vehicle's place jumped against odometry from one located scan to the next.
  Summary correction_m;

  /// Never lost, nearly always located, and the scans fit the map.
  [[nodiscard]] bool is_sure() const {
    return lost == 0 && 10 * located >= 9 * scans && score.median >= kSureScore;
  }
};

/// The frame `map` at the end of a run.
struct MapFrameSummary {
  MapFrameSource source = MapFrameSource::kOdometry;
  bool corrected = false;                ///< `map` is not `odom`: map and trajectory were made anew
  SE2 T_map_odom;                        ///< at the end
  double max_shift_m = 0;                ///< largest distance of a pose in `map` from the same in `odom`
  std::vector<MapFrameChange> history;   ///< while the recording ran
  Summary ms;                            ///< cost, a scan
  double rebuild_s = 0;                  ///< cost of the map in the frame `map`
  std::optional<MvogSize> mvog_odom;     ///< of the map in `odom`, before it was made anew
  std::size_t nodes = 0, solutions = 0;  ///< of the graph; how often it was solved
  ScanGraphStatistics loops;
  LoopRevision revision;                   ///< of the loops, at the end
  KeyframeRegistration registration;       ///< of the graph's keyframes, after it
  std::optional<std::size_t> wrong_loops;  ///< of those closed, where the recording has the truth
  std::optional<LocalisationSummary> localisation;
};

/// A part of a run whose scans are joined by confirmed matches, and whose map does not contradict itself.
struct LaserPiece {
  Time begin, end;                 ///< of the poses of its first and its last scan
  double begin_s = 0, end_s = 0;   ///< the same since the start of the recording
  std::size_t scans = 0;           ///< with a pose
  double path_m = 0;               ///< driven in it
  std::filesystem::path map = {};  ///< below the folder of results
};
/// Folder of their maps below that of the results.
inline constexpr const char* kPiecesFolder = "pieces";

/// Result of a run.
struct LaserSummary {
  std::filesystem::path recording;
  std::string kind, laser;  ///< kind of recording; the laser whose scans were matched, or all that were used
  LaserRunParameters parameters;
  bool interrupted = false;
  LaserPace pace = LaserPace::kFast;
  bool matched_scans = false;
  bool planar = true;                ///< the map is one layer
  std::vector<std::string> choices;  ///< what was used of the recording, and why

  std::size_t scans_total = 0, scans_read = 0, scans_matched = 0, scans_failed = 0, keyframes = 0;
  /// Scans were measured so long before their stamps on the clock of the odometry, as turns show
  /// (WheelDelay).
  double odometry_delay_s = 0;
  std::size_t scans_searched = 0;  ///< searched for among the last keyframes, for want of a good prediction
  std::size_t scans_found = 0;     ///< of these, with a pose from there, as matching gave none
  std::size_t restarts = 0;        ///< scan matching was lost, and began anew at a predicted pose
  std::size_t scans_unconfirmed = 0;  ///< with a pose that no match and no search confirmed
  /// Motion along bare walls whose length nothing but an earlier velocity says: in all, and the longest.
  double guessed_m = 0, longest_guess_m = 0;
  std::size_t scans_length_unobserved = 0;  ///< that show nothing of the motion along walls, without wheels
  std::size_t scans_dropped = 0;            ///< live: came too fast
  std::map<std::string, std::size_t> failure_reasons;
  std::vector<LaserScanRecord> records;  ///< of more than LaserRunOptions::most_records an even thinning
  double run_s = 0, recording_s = 0;
  Summary scan_ms;  ///< everything that is done when a scan is processed
  Summary match_ms, insert_ms;
  double insert_us_per_beam = 0;
  std::size_t beams = 0;  ///< that went into the map

  MvogSize mvog;
  std::size_t columns_refused = 0;  ///< not updated because of the map's memory limit, counted each time
  Box3 bounds_m;
  std::vector<FloorLevel> floors;
  MapFrameSummary map_frame;
  Trajectory trajectory;  ///< T_map_base of the scans that have a pose, with all that is known at the end
  Trajectory trajectory_odom;  ///< T_odom_base of the same, never corrected
  Trajectory truth;            ///< T_world_base, of the recording
  std::string truth_source;
  std::optional<TrajectoryError> error;       ///< of `trajectory`
  std::optional<TrajectoryError> error_odom;  ///< of `trajectory_odom`, where it is another
  std::optional<HeightError> height_error;
  std::optional<RelationErrors> relation_error;       ///< of `trajectory`
  std::optional<RelationErrors> relation_error_odom;  ///< of `trajectory_odom`, where it is another
  RunVerdict verdict;
  std::vector<LaserPiece> pieces;  ///< of a broken map
  std::vector<std::string> warnings;
  std::vector<std::filesystem::path> outputs;
};

/// Summary of the frame alone: all but ms, localisation, rebuild_s, mvog_odom, max_shift_m.
MapFrameSummary summarise_map_frame(const LaserMapFrame& frame);

/// T_map_odom over time, as columns.
JsonValue history_to_json(const MapFrameSummary& summary, Time begin);
/// stamp_s, x_m, y_m, yaw_rad of T_map_odom, a line a change.
std::string map_frame_csv(const MapFrameSummary& summary);

/// scans{read,matched,failed,keyframes}, match_ms{median,p99}, path_length_m ... (the keys of `hm laser
/// --json`).
void visit(const LaserSummary& summary, SummaryTree& v);
/// Size of a map: bytes, area_m2, volumes_positive, volumes_negative, columns, tiles.
void visit(const MvogSize& size, SummaryTree& v);
/// A few lines for a terminal.
std::string to_text(const LaserSummary& summary);

/// The floors that were found, lowest first.
std::string floors_csv(std::span<const FloorLevel> floors);

}  // namespace hm
