#include "hm/pipeline/laser/run/laser_run_report.hpp"

#include <array>
#include <cmath>

#include "hm/report/plot.hpp"
#include "hm/report/run_report.hpp"

namespace hm {
namespace {

/// Adds what the correction changed: errors and sizes in `odom` and in `map`.
void add_before_and_after(HtmlReport& report, const LaserSummary& laser, const SummaryTree& summary) {
  SummaryTree::Rows rows;
  const auto compare = [&](const char* what, const char* before, const char* after) {
    if (const auto first = summary.sentence(before)) rows.push_back({what, *first, *summary.sentence(after)});
  };
  compare("position error against the truth, RMSE", "{ate_rmse_odom_m}", "{ate_rmse_m}");
  compare("relations, mean error", "{relation_error_odom_m.mean}", "{relation_error_m.mean}");
  if (const auto& odom = laser.map_frame.mvog_odom) {
    const auto before = describe(*odom).rows(), after = summary.rows("mvog");
    for (std::size_t i = 0; i < before.size(); ++i) rows.push_back({before[i][0], before[i][1], after[i][1]});
  }
  if (!rows.empty()) report.add_table({"", "before correction (odom)", "after correction (map)"}, rows);
}

void add_scores(HtmlReport& report, const LaserSummary& summary) {
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
  plot.x.label = "time (s)", plot.y.label = "T_map_odom";
  report.add_svg(plot_svg(series, plot),
                 "The correction T_map_odom over time: the pose of the frame odom in the frame map, as it "
                 "was known then.");
}

using Getter = std::optional<double> (*)(const LaserScanRecord&);

/// One value of each record that has it, over time.
PlotSeries series_of(const LaserSummary& summary, std::string name, Getter get) {
  PlotSeries series;
  series.name = std::move(name);
  for (const LaserScanRecord& record : summary.records)
    if (const auto value = get(record)) {
      series.x.push_back(record.time_s);
      series.y.push_back(*value);
    }
  return series;
}

std::optional<double> height_of(const LaserScanRecord& record) {
  if (!record.step.height || record.step.height->status != HeightStatus::kOk) return std::nullopt;
  return record.step.height->height_m;
}
std::optional<double> floor_of(const LaserScanRecord& record) {
  if (!record.step.height || record.step.height->status != HeightStatus::kOk) return std::nullopt;
  return record.step.height->floor_level_m;
}
std::optional<double> match_ms_of(const LaserScanRecord& record) {
  if (!record.step.matched_scan) return std::nullopt;
  return record.step.match_ms;
}
template <int kAxis>
std::optional<double> velocity_of(const LaserScanRecord& record) {
  if (!record.step.matched_scan || !record.step.T_odom_base) return std::nullopt;
  return record.step.velocity_base(kAxis);
}
/// The fused velocity along the vehicle's own axes.
template <int kAxis>
std::optional<double> fused_velocity_of(const LaserScanRecord& record) {
  if (!record.step.state || !record.step.state->planar_ready) return std::nullopt;
  const VehicleState& state = *record.step.state;
  const double yaw = state.roll_pitch_yaw_rad.z();
  const Vec3& v = state.velocity_m_s;
  if constexpr (kAxis == 0) return std::cos(yaw) * v.x() + std::sin(yaw) * v.y();
  return -std::sin(yaw) * v.x() + std::cos(yaw) * v.y();
}
std::optional<double> map_mb_of(const LaserScanRecord& record) {
  if (!record.map) return std::nullopt;
  return static_cast<double>(record.map->bytes) * 1e-6;
}
std::optional<double> map_area_of(const LaserScanRecord& record) {
  if (!record.map) return std::nullopt;
  return record.map->area_m2;
}

std::optional<double> localisation_score_of(const LaserScanRecord& record) {
  const auto& place = record.step.map_frame.localisation;
  if (!place || !place->T_map_base) return std::nullopt;
  return place->score;
}

PlotOptions over_time(std::string label) {
  PlotOptions plot;
  plot.x.label = "time (s)";
  plot.y.label = std::move(label);
  return plot;
}

void add_key_numbers(HtmlReport& report, const SummaryTree& summary) {
  add_cards(report, summary,
            {{"position error", "{ate_rmse_m}", "RMSE after fitting to the truth"},
             {"height error", "{height_rmse_m}", "RMSE"},
             {"scans", "{scans.posed}", "of {scans.total} have a pose"},
             {"path", "{path_length_m}", "in {recording_s}[; true path {truth_path}]"},
             {"located", "{localisation.located}", "of {localisation.scans|scan} in the saved map"},
             {"loops", "{loops.closed}", "closed, of {loops.candidates|candidate}"},
             {"relations", "{relation_error_m.mean}", "mean error of {relations.used|relative pose}"},
             {"map", "{mvog.area_m2}", "{mvog.bytes}; {insert_us_per_beam} a beam"},
             {"matching", "{match_ms.median}", "a scan, median; 99 % under {match_ms.p99}"}});
}

void add_path_section(HtmlReport& report, const LaserSummary& summary) {
  report.begin_section("Path");
  PlotOptions plot;
  plot.x.label = "x (m)", plot.y.label = "y (m)";
  plot.equal_aspect = true;
  plot.height_px = 360;
  if (!summary.error) {
    const std::array<NamedTrajectory, 1> paths{{{"estimate", &summary.trajectory}}};
    report.add_svg(trajectory_svg(paths, plot), "The path from above.");
    return;
  }
  Trajectory truth, estimate;
  for (const PosePair& pair : summary.error->matched) {
    truth.push_back({pair.stamp, pair.T_world_truth});
    estimate.push_back({pair.stamp, pair.T_world_estimate});
  }
  const std::array<NamedTrajectory, 2> paths{{{"truth", &truth}, {"estimate", &estimate}}};
  report.add_svg(trajectory_svg(paths, plot),
                 fmt::format("The path from above, fitted to the truth ({}).", summary.truth_source));
  PlotSeries errors{"position error", {}, summary.error->position_errors_m, SeriesStyle::kLine};
  for (const PosePair& pair : summary.error->matched)
    errors.x.push_back((pair.stamp - summary.error->matched.front().stamp).seconds());
  report.add_svg(plot_svg({&errors, 1}, over_time("position error (m)")), "Distance from the truth.");
}

/// Adds the section about the frame `map`: loops or the place in a saved map, what the correction changed,
/// and where `odom` lay over time. Nothing where `map` is `odom` by choice.
void add_map_frame_section(HtmlReport& report, const LaserSummary& laser, const SummaryTree& summary) {
  const MapFrameSummary& map = laser.map_frame;
  if (map.source == MapFrameSource::kOdometry) return;
  report.begin_section(
      map.localisation ? "Place in the map" : "Loops",
      map.corrected
          ? fmt::format("Path and map are those of the corrected poses, up to {:.2f} m from odometry's; "
                        "the map was rebuilt in {:.1f} s.",
                        map.max_shift_m, map.rebuild_s)
          : std::string("No loop was closed: path and map are those of odometry."));
  report.add_paragraph(
      "Poses are given in two frames. odom is the frame of scan matching: it is continuous, and it drifts. "
      "map is "
      "the corrected frame: closed loops, or the saved map, correct it, so it does not drift, but a pose in "
      "it "
      "can jump. T_map_odom transforms from odom to map.");
  add_before_and_after(report, laser, summary);
  add_summary_table(report, summary, map.localisation ? "localisation" : "loops");
  if (map.localisation) add_scores(report, laser);
  add_history(report, laser);
}

void add_height_section(HtmlReport& report, const LaserSummary& summary) {
  std::vector<PlotSeries> series{series_of(summary, "height", height_of),
                                 series_of(summary, "floor", floor_of)};
  if (series.front().x.empty()) return;
  series.back().style = SeriesStyle::kStep;
  if (summary.height_error && !summary.records.empty()) {
    PlotSeries truth{"truth", {}, {}, SeriesStyle::kLine};
    const Time begin = summary.records.front().step.stamp;
    for (const StampedPose& pose : summary.truth) {
      truth.x.push_back((pose.stamp - begin).seconds() + summary.records.front().time_s);
      truth.y.push_back(pose.T_world_base.translation().z() - summary.height_error->offset_m);
    }
    series.push_back(std::move(truth));
  }
  report.begin_section("Height", "Height of the vehicle above the floor where it started.");
  report.add_svg(plot_svg(series, over_time("height (m)")),
                 "Height, and the level of the floor below the vehicle.");
  add_list_table(report, describe(summary), "floors");
}

void add_pieces_section(HtmlReport& report, const LaserSummary& laser, const SummaryTree& summary) {
  if (laser.pieces.empty()) return;
  report.begin_section(
      "Pieces",
      "The whole map is torn. Each of these pieces is consistent: confirmed matches join its "
      "scans, and its visits of a place agree. How the pieces lie to each other is not known.");
  add_list_table(report, summary, "pieces");
}

void add_motion_section(HtmlReport& report, const LaserSummary& summary) {
  if (!summary.matched_scans) return;
  report.begin_section("Velocity", "Along the vehicle's own axes.");
  std::vector<PlotSeries> speeds{series_of(summary, "forward", velocity_of<0>),
                                 series_of(summary, "to the left", velocity_of<1>)};
  for (auto& fused : {series_of(summary, "forward, fused", fused_velocity_of<0>),
                      series_of(summary, "to the left, fused", fused_velocity_of<1>)})
    if (!fused.x.empty()) speeds.push_back(fused);
  const std::string beyond = set_aside_unphysical(speeds, kMaxSpeed_m_s, "m/s");
  report.add_svg(plot_svg(speeds, over_time("velocity (m/s)")), "Velocity from scan matching." + beyond);
  std::vector<PlotSeries> turning{series_of(summary, "yaw rate", velocity_of<2>)};
  const std::string too_fast = set_aside_unphysical(turning, kMaxTurnRate_rad_s, "rad/s");
  report.add_svg(plot_svg(turning, over_time("yaw rate (rad/s)")), "How fast the vehicle turns." + too_fast);
}

void add_cost_section(HtmlReport& report, const LaserSummary& summary) {
  report.begin_section(
      "Cost", fmt::format("{:.1f} s for a recording of {:.1f} s.", summary.run_s, summary.recording_s));
  if (summary.matched_scans) {
    PlotSeries times = series_of(summary, "matching", match_ms_of);
    times.style = SeriesStyle::kScatter;
    report.add_svg(plot_svg({&times, 1}, over_time("time (ms)")), "Time of scan matching.");
  }
  const PlotSeries size = series_of(summary, "map", map_mb_of),
                   area = series_of(summary, "area", map_area_of);
  report.add_svg(plot_svg({&size, 1}, over_time("memory (MB)")), "Memory of the map.");
  report.add_svg(plot_svg({&area, 1}, over_time("area (m2)")), "Area of the map.");
}

void add_failures(HtmlReport& report, const SummaryTree& summary) {
  const auto rows = summary.rows("failure_reasons");
  if (rows.empty()) return;
  report.begin_section("Scans without a pose");
  report.add_table({"reason", "scans"}, rows);
}

}  // namespace

std::string laser_report_html(const LaserSummary& summary, const LaserReportMaterial& material) {
  const SummaryTree tree = describe(summary);
  HtmlReport report(folder_title(summary.recording), "Laser");
  report.set_verdict(
      report_verdict(summary.verdict),
      verdict_sentence(
          summary.verdict,
          *tree.sentence(
              "{scans.posed} of {scans.total|scan} have a pose over {path_length_m}; the map covers "
              "{mvog.area_m2}[; the path is off by {ate_rmse_m} (rmse)].")));
  add_key_numbers(report, tree);
  add_warnings_section(report, summary.warnings);
  set_lead_figure(report, material.figures, "plan");
  const bool more = material.figures.size() > 1;  // than the one that leads
  if (more) report.begin_section("Map");
  for (const Figure& figure : material.figures)
    if (more) add_figure(report, figure);
  add_path_section(report, summary);
  add_visits_section(report, summary.verdict);
  add_pieces_section(report, summary, tree);
  add_map_frame_section(report, summary, tree);
  add_height_section(report, summary);
  add_motion_section(report, summary);
  add_cost_section(report, summary);
  add_failures(report, tree);
  report.begin_section("Recording", fmt::format("{} ({})", summary.recording.string(), summary.kind));
  report.add_list(summary.choices);
  return page_with_parameters(report, material.parameters_toml, material.program_version);
}

JsonValue laser_report_json(const LaserSummary& summary, const std::string& program_version) {
  auto json = to_json(summary);
  json["version"] = program_version;
  json["recording"] = summary.recording.string();
  auto series = JsonValue::object();
  const auto add = [&](const char* key, Getter get) {
    const PlotSeries values = series_of(summary, key, get);
    if (values.x.empty()) return;
    series[key] = JsonValue::object(
        {{"time_s", JsonValue::array_of(values.x)}, {"value", JsonValue::array_of(values.y)}});
  };
  add("match_ms", match_ms_of);
  add("height_m", height_of);
  add("floor_level_m", floor_of);
  add("forward_m_s", velocity_of<0>);
  add("left_m_s", velocity_of<1>);
  add("yaw_rate_rad_s", velocity_of<2>);
  add("map_mb", map_mb_of);
  add("map_area_m2", map_area_of);
  add("localisation_score", localisation_score_of);
  json["series"] = std::move(series);
  if (summary.map_frame.source != MapFrameSource::kOdometry && !summary.records.empty()) {
    const LaserScanRecord& first = summary.records.front();
    json["T_map_odom_history"] =
        history_to_json(summary.map_frame, first.step.stamp - Duration::from_seconds(first.time_s));
  }
  return json;
}

}  // namespace hm
