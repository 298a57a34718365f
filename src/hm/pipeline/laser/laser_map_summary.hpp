#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "hm/core/json_value.hpp"
#include "hm/core/statistics.hpp"
#include "hm/mvog/multi_volume_grid.hpp"
#include "hm/pipeline/laser/laser_map_frame.hpp"

namespace hm {

struct LaserScanRecord;

/// How sure a vehicle was of its place in a saved map.
struct LocalisationSummary {
  /// A median score below this speaks of another place, or of a place that has changed.
  static constexpr double kSureScore = 0.8;
  std::filesystem::path map;
  std::size_t located = 0;   ///< scans whose place was found or followed
  std::size_t sought = 0;    ///< scans that were asked for it
  std::size_t searches = 0;  ///< of these, in the whole map
  std::size_t found = 0, ambiguous = 0, not_found = 0, gave_up = 0;  ///< what became of the searches
  std::size_t match_failed = 0, lost = 0, too_few_points = 0;
  std::optional<double> first_fix_s;  ///< since the start of the recording
  Summary score;                      ///< mean likelihood of the points, of the located scans
  /// How far the vehicle's place jumped against odometry from one located scan to the next: what the two
  /// disagree.
  Summary correction_m;

  /// Never lost, nearly always located, and the scans fit the map.
  [[nodiscard]] bool is_sure() const {
    return lost == 0 && 10 * located >= 9 * sought && score.median >= kSureScore;
  }
};

/// What is known of the frame `map` at the end of a run.
struct LaserMapSummary {
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
  std::optional<LocalisationSummary> localisation;
};

/// All of it but rebuild_s, mvog_odom, max_shift_m.
LaserMapSummary summarise_map_frame(const LaserMapFrame& frame, std::span<const LaserScanRecord> records);

/// The keys `loops` or `localisation` of a run, null where there is none.
JsonValue loops_to_json(const LaserMapSummary& summary);
JsonValue localisation_to_json(const LaserMapSummary& summary);
/// T_map_odom over time, as columns.
JsonValue history_to_json(const LaserMapSummary& summary, Time begin);
/// stamp_s, x_m, y_m, yaw_rad of T_map_odom, a line a change.
std::string map_frame_csv(const LaserMapSummary& summary);
/// In a few lines for a terminal; empty where `map` is `odom`.
std::string to_text(const LaserMapSummary& summary);

}  // namespace hm
