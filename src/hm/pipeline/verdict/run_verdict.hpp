#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hm/core/json_value.hpp"
#include "hm/core/result.hpp"
#include "hm/geometry/se2.hpp"
#include "hm/report/html_report.hpp"
#include "hm/report/summary_tree.hpp"

namespace hm {

/// Quality of the result of a run, judged without truth.
enum class MapVerdict {
  kOk,        ///< nothing speaks against it
  kDoubtful,  ///< parts of it may be wrong
  kBroken,    ///< it contradicts itself: not to be used as a whole
};
std::string_view to_string(MapVerdict verdict);

/// One view or scan compared with those of other visits of its place.
struct VisitComparison {
  double time_s = 0;  ///< since the start of the recording
  /// Share of the points in common that stand in the free space of another visit.
  double contradicted_ratio = 0;
  Vec2 place_m = Vec2::Zero();  ///< from above, in the frame of the map
};

/// Medians of a window of values that moves along them.
struct WindowMedians {
  std::vector<double> medians;  ///< of the window around each value
  double worst = 0;             ///< largest of them (of all values, where there are less than a window)
  std::size_t worst_index = 0;  ///< middle of that window
};
WindowMedians window_medians(const std::vector<double>& values, std::size_t window);

/// Comparisons along a run, by the median of a window of some of them that moves along it.
struct VisitConsistency {
  std::size_t places = 0;   ///< comparisons
  double worst_ratio = 0;   ///< largest median of a window (of all comparisons, where there are less)
  double worst_time_s = 0;  ///< of the middle of that window
  double p95_ratio = 0;     ///< 95 % of the windows have a smaller median
  /// Depth cameras: largest median of a window of the relative difference of depth.
  std::optional<double> worst_offset_ratio;
  std::vector<VisitComparison> comparisons;
  std::vector<double> medians;  ///< of the window around each comparison
};
VisitConsistency summarise_visits(std::vector<VisitComparison> comparisons, std::size_t window);
void visit(const VisitConsistency& visits, SummaryTree& v);

/// Depth images compared with the next one; differences of the pair that speaks most against the path.
struct StepConsistency {
  std::size_t compared = 0;
  double worst_time_s = 0;
  double contradicted_ratio = 0, offset_ratio = 0, tilt_rad = 0;
  std::optional<double> color_rad;  ///< turn or shift of the colour images, where these show it
};
void visit(const StepConsistency& steps, SummaryTree& v);

/// Verdict of a run, with what speaks against its result, the gravest first.
struct RunVerdict {
  MapVerdict value = MapVerdict::kOk;
  std::vector<std::string> reasons;
  std::optional<VisitConsistency> visits;  ///< where visits were compared
  std::optional<StepConsistency> steps;    ///< where neighbouring depth images were compared
  double doubtful_ratio = 1;               ///< from here on a window speaks against the result
  /// The verdict is the gravest of all that were added. kOk adds nothing.
  void add(MapVerdict verdict, std::string reason);
};

/// "value", "reasons", "visits{}", "steps{}"; the key "text" for sentences: "doubtful: why; why".
void visit(const RunVerdict& verdict, SummaryTree& v);
/// The verdict that a report in JSON has, without its comparisons; ok where it has none.
RunVerdict verdict_of_report(const JsonValue& report);
/// First sentence of a report: the verdict and its gravest reason, then what the result is.
std::string verdict_sentence(const RunVerdict& verdict, const std::string& result);
/// Colour of that sentence.
HtmlReport::Verdict report_verdict(const RunVerdict& verdict);
/// The failure of a run that was asked to fail unless its verdict is ok.
std::optional<Error> strict_failure(const RunVerdict& verdict);

/// Shares of contradicted points from which on a result is doubtful or broken, by sensor.
struct VisitLimits {
  std::size_t window;       ///< comparisons
  double doubtful_ratio;    ///< in the worst window
  double broken_ratio;      ///< in the worst window; 1: it does not decide
  double broken_p95_ratio;  ///< in 5 % of the windows
  /// Length of path that a window spans at most, if it has five comparisons then: what is wrong for a few
  /// metres must not vanish among places far from it. 0: as many comparisons however far apart.
  double window_m = 0;
};
/// Adds what the comparisons say. Less than nine of them call a result broken only where they are five or
/// more and their median is over 0.6; less than five never. `what`: "scans".
void judge_visits(std::vector<VisitComparison> comparisons, const VisitLimits& limits, std::string_view what,
                  RunVerdict& verdict);

/// Adds what checks before the run say against any result of it.
void add_doubts(std::vector<std::string> doubts, RunVerdict& verdict);

/// Adds how many of the frames or scans have no pose, where they are many. `what`: "scans".
void judge_missing_poses(std::size_t missing, std::size_t all, std::string_view what, RunVerdict& verdict);

/// Limit of a map's memory, and what it has refused.
struct MemoryLimit {
  std::string_view parameter;  ///< "tsdf.max_map_mb"
  int max_map_mb = 0;          ///< 0: none
  std::size_t refused = 0;
  std::string_view unit;  ///< what was refused, counted each time: "block"
};
/// Adds a warning, and that the result is doubtful, where the limit has kept a map from growing.
void judge_memory_limit(const MemoryLimit& limit, std::vector<std::string>& warnings, RunVerdict& verdict);

/// Adds where and when visits contradict each other; nothing where none were compared.
void add_visits_section(HtmlReport& report, const RunVerdict& verdict);

}  // namespace hm
