#include "hm/pipeline/laser/laser_map_report.hpp"

#include "hm/report/plot.hpp"

namespace hm {
namespace {

using Rows = std::vector<std::vector<std::string>>;

void add_before_and_after(HtmlReport& report, const LaserSummary& summary) {
  Rows rows;
  const auto compare = [&](const char* what, const std::string& before, const std::string& after) {
    rows.push_back({what, before, after});
  };
  if (summary.error && summary.error_odom)
    compare("position error against the truth, RMSE",
            fmt::format("{:.3f} m", summary.error_odom->position_m.rmse),
            fmt::format("{:.3f} m", summary.error->position_m.rmse));
  if (summary.relation_error && summary.relation_error_odom)
    compare("relations, mean error", fmt::format("{:.4f} m", summary.relation_error_odom->translation_m.mean),
            fmt::format("{:.4f} m", summary.relation_error->translation_m.mean));
  if (const auto& odom = summary.map_frame.mvog_odom) {
    compare("area of the map", fmt::format("{:.1f} m2", odom->area_m2),
            fmt::format("{:.1f} m2", summary.mvog.area_m2));
    compare("occupied volumes", std::to_string(odom->volumes_positive),
            std::to_string(summary.mvog.volumes_positive));
    compare("memory", fmt::format("{:.2f} MB", static_cast<double>(odom->bytes) * 1e-6),
            fmt::format("{:.2f} MB", static_cast<double>(summary.mvog.bytes) * 1e-6));
  }
  if (!rows.empty()) report.add_table({"", "in odom", "in map"}, rows);
}

void add_loops(HtmlReport& report, const LaserMapSummary& map) {
  const ScanGraphStatistics& loops = map.loops;
  report.add_table({"searches for loops", ""},
                   Rows{{"candidates", std::to_string(loops.candidates)},
                        {"closed", std::to_string(loops.accepted)},
                        {"the scan fits nowhere", std::to_string(loops.no_match)},
                        {"it fits several places", std::to_string(loops.ambiguous)},
                        {"search given up", std::to_string(loops.gave_up)},
                        {"not confirmed by PL-ICP", std::to_string(loops.not_verified)},
                        {"taken out again: the others contradict", std::to_string(loops.taken_out)},
                        {"nodes of the graph", std::to_string(map.nodes)},
                        {"times solved", std::to_string(map.solutions)}});
}

void add_place(HtmlReport& report, const LaserSummary& summary, const LocalisationSummary& place) {
  report.add_table({"place in the map", place.map.string()},
                   Rows{{"scans that were located", fmt::format("{} of {}", place.located, place.sought)},
                        {"first after", fmt::format("{:.2f} s", place.first_fix_s.value_or(0))},
                        {"searches of the whole map",
                         fmt::format("{}: {} found, {} ambiguous, {} nowhere, {} given up", place.searches,
                                     place.found, place.ambiguous, place.not_found, place.gave_up)},
                        {"lost", std::to_string(place.lost)},
                        {"score of the located scans (1: every point on a wall)",
                         fmt::format("{:.2f} median, {:.2f} least", place.score.median, place.score.min)},
                        {"jumps against odometry, a scan",
                         fmt::format("{:.3f} m median, {:.3f} m 99 %", place.correction_m.median,
                                     place.correction_m.p99)}});
  PlotSeries scores{"score", {}, {}, SeriesStyle::kScatter};
  for (const LaserScanRecord& record : summary.records)
    if (const auto& found = record.step.map_frame.localisation; found && found->T_map_base) {
      scores.x.push_back(record.time_s);
      scores.y.push_back(found->score);
    }
  PlotOptions plot;
  plot.x.label = "time (s)", plot.y.label = "score";
  report.add_svg(plot_svg({&scores, 1}, plot), "How well the scans fit the map where they were placed.");
}

void add_history(HtmlReport& report, const LaserSummary& summary) {
  if (summary.map_frame.history.empty() || summary.records.empty()) return;
  std::vector<PlotSeries> series{{"x (m)", {}, {}, SeriesStyle::kStep},
                                 {"y (m)", {}, {}, SeriesStyle::kStep},
                                 {"yaw (rad)", {}, {}, SeriesStyle::kStep}};
  const LaserScanRecord& first = summary.records.front();
  for (const MapFrameChange& change : summary.map_frame.history)
    for (std::size_t i = 0; i < series.size(); ++i) {
      series[i].x.push_back((change.stamp - first.step.stamp).seconds() + first.time_s);
      series[i].y.push_back(change.T_map_odom.vector()(static_cast<Eigen::Index>(i)));
    }
  PlotOptions plot;
  plot.x.label = "time (s)", plot.y.label = "odom in map";
  report.add_svg(plot_svg(series, plot),
                 "Where the frame odom lay in map, as it was known then. It may jump; odom itself does not.");
}

}  // namespace

void add_map_frame_section(HtmlReport& report, const LaserSummary& summary) {
  const LaserMapSummary& map = summary.map_frame;
  if (map.source == MapFrameSource::kOdometry) return;
  report.begin_section(
      map.localisation ? "Place in the map" : "Loops",
      map.corrected
          ? fmt::format("Path and map are those of the corrected poses, up to {:.2f} m from odometry's; "
                        "the map was made anew in {:.1f} s.",
                        map.max_shift_m, map.rebuild_s)
          : std::string("No loop was closed: path and map are those of odometry."));
  add_before_and_after(report, summary);
  if (map.localisation)
    add_place(report, summary, *map.localisation);
  else
    add_loops(report, map);
  add_history(report, summary);
}

}  // namespace hm
