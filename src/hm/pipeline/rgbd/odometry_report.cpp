#include "hm/pipeline/rgbd/odometry_report.hpp"

#include <array>

#include "hm/report/path_plots.hpp"
#include "hm/report/plot.hpp"
#include "hm/report/run_report.hpp"
#include "hm/report/trajectory_plots.hpp"

namespace hm {
namespace {

using Getter = double (*)(const VisualFrame&);

/// One value of every frame that was tracked or tried, over the frame's number.
PlotSeries series_of(const VisualTrack& track, std::string name, Getter get,
                     SeriesStyle style = SeriesStyle::kLine) {
  PlotSeries series{std::move(name), {}, {}, style};
  for (const VisualFrame& frame : track.frames) {
    if (frame.status == TrackingStatus::kSkipped) continue;
    series.x.push_back(static_cast<double>(frame.index));
    series.y.push_back(get(frame));
  }
  return series;
}

struct Part {
  const char *key, *name;
  Getter get;
};
constexpr std::array<Part, 4> kStages{
    {{"features_ms", "features", [](const VisualFrame& f) { return f.numbers.features_ms; }},
     {"prediction_ms", "prediction", [](const VisualFrame& f) { return f.numbers.prediction_ms; }},
     {"registration_ms", "registration", [](const VisualFrame& f) { return f.numbers.registration_ms; }},
     {"model_ms", "model", [](const VisualFrame& f) { return f.numbers.model_ms; }}}};
constexpr std::array<Part, 4> kCounts{
    {{"features", "features", [](const VisualFrame& f) { return static_cast<double>(f.numbers.features); }},
     {"features_with_depth", "of them with depth",
      [](const VisualFrame& f) { return static_cast<double>(f.numbers.features_with_depth); }},
     {"matches", "matches", [](const VisualFrame& f) { return static_cast<double>(f.numbers.matches); }},
     {"inliers", "inliers", [](const VisualFrame& f) { return static_cast<double>(f.numbers.inliers); }}}};

double model_points_of(const VisualFrame& frame) { return static_cast<double>(frame.numbers.model_points); }
double total_ms_of(const VisualFrame& frame) { return frame.numbers.total_ms; }
double sharpness_of(const VisualFrame& frame) { return frame.numbers.sharpness; }
double coverage_of(const VisualFrame& frame) { return 100 * frame.numbers.depth_coverage_ratio; }
double sigma_mm_of(const VisualFrame& frame) { return 1e3 * frame.sigma_m; }

PlotOptions over_frames(std::string label) {
  PlotOptions plot;
  plot.x.label = "frame", plot.y.label = std::move(label);
  return plot;
}

void add_one(HtmlReport& report, const PlotSeries& series, std::string label, std::string caption) {
  report.add_svg(plot_svg({&series, 1}, over_frames(std::move(label))), std::move(caption));
}

void add_sizes(HtmlReport& report, const VisualTrack& track) {
  report.begin_section("Model and data");
  const PlotSeries model = series_of(track, "model", model_points_of);
  add_one(report, model, "points", "Points in the persistent model after each frame.");
  std::vector<PlotSeries> counts;
  for (const Part& part : kCounts) counts.push_back(series_of(track, part.name, part.get));
  report.add_svg(plot_svg(counts, over_frames("per frame")),
                 "Features of each frame, and how many of them the model explains.");
}

void add_times(HtmlReport& report, const VisualTrack& track) {
  report.begin_section("Time", "Of tracking, on one thread; reading and decoding happen beside it.");
  std::vector<PlotSeries> stages;
  std::vector<std::vector<std::string>> rows;
  const auto row = [&](const char* name, const std::vector<double>& values) {
    const Summary times = summarise(values);
    rows.push_back({name, fmt::format("{:.2f}", times.mean), fmt::format("{:.2f}", times.median),
                    fmt::format("{:.2f}", times.p99), fmt::format("{:.2f}", times.max)});
  };
  for (const Part& stage : kStages) {
    stages.push_back(series_of(track, stage.name, stage.get, SeriesStyle::kArea));
    row(stage.name, stages.back().y);
  }
  row("all", series_of(track, "all", total_ms_of).y);
  report.add_svg(stacked_series_svg(stages, over_frames("time (ms)")), "Duration of each frame by stage.");
  report.add_table({"stage", "mean (ms)", "median (ms)", "99 % (ms)", "longest (ms)"}, rows);
}

void add_inertial(HtmlReport& report, const SummaryTree& summary) {
  if (summary.rows("imu").empty()) return;
  report.begin_section("Inertial device", "Readings that were taken beside the camera, and their use.");
  add_summary_table(report, summary, "imu");
}

/// Adds the first rows of a list as a section, and how many more there are.
void add_first(HtmlReport& report, SummaryTree::Table table, std::size_t most) {
  const std::size_t all = table.rows.size();
  table.rows.resize(std::min(all, most));
  report.add_table(table.header, table.rows);
  if (all > most) report.add_paragraph(fmt::format("and {} more", all - most));
}

void add_lost(HtmlReport& report, const VisualTrack& track, const SummaryTree& summary) {
  if (track.lost.empty()) return;
  report.begin_section("Lost", "Stretches without a pose; the model is not touched by them.");
  add_first(report, summary.table("lost_stretches"), 100);
}

void add_unused(HtmlReport& report, const VisualTrack& track, const SummaryTree& summary) {
  if (track.unused.empty()) return;
  report.begin_section("Unused frames");
  add_first(report, summary.table("unused_frames"), 50);
}

void add_path_section(HtmlReport& report, const OdometrySummary& summary) {
  report.begin_section("Path");
  if (!summary.error) {
    const std::array<NamedTrajectory, 1> paths{{{"odometry", &summary.track.trajectory}}};
    add_path_views(report, paths, {});
    return add_motion_plots(report, paths);
  }
  const Trajectory truth = matched_truth(*summary.error), estimate = matched_estimate(*summary.error);
  const std::array<NamedTrajectory, 2> paths{{{"truth", &truth}, {"odometry", &estimate}}};
  add_path_views(report, paths, "Odometry is fitted to the recording's own poses.");
  report.begin_section("Error", "Against the recording's own poses, which tracking does not see.");
  add_error_statistics(report, *summary.error);
  add_error_path(report, *summary.error);
  add_position_histogram(report, *summary.error);
  add_error_plots(report, *summary.error);
  add_relative_table(report, *summary.error);
  report.begin_section("Pose over time", "Odometry is fitted to the recording's own poses.");
  add_pose_components(report, *summary.error);
  const std::array<NamedTrajectory, 1> whole{{{"odometry", &summary.track.trajectory}}};
  add_motion_plots(report, whole);
}

}  // namespace

void add_tracking_cards(HtmlReport& report, const SummaryTree& summary) {
  add_cards(report, summary,
            {{"frames", "{frames.tracked}", "of {frames.total} have a pose; {frames.lost} lost"},
             {"path", "{path_length_m}", "{keyframes|keyframe}"},
             {"tracking", "{track_ms.mean}", "a frame, mean; 99 % under {track_ms.p99}"}});
}

void add_error_cards(HtmlReport& report, const SummaryTree& summary) {
  add_cards(report, summary,
            {{"ATE", "{ate_rmse_m}", "rmse of the position"},
             {"RPE", "{rpe_second_m}", "a second, rmse; {rpe_second_rad}"}});
}

void add_tracking_sections(HtmlReport& report, const VisualTrack& track, const SummaryTree& summary) {
  add_lost(report, track, summary);
  add_inertial(report, summary);
  add_sizes(report, track);
  add_times(report, track);
  report.begin_section("Images and certainty");
  add_one(report, series_of(track, "sharpness", sharpness_of), "variance of the Laplacian",
          "Sharpness of the colour image: low where it is blurred, dark or bare.");
  add_one(report, series_of(track, "depth", coverage_of), "pixels with depth (%)",
          "Coverage of the depth image.");
  add_one(report, series_of(track, "position", sigma_mm_of), "standard deviation (mm)",
          "Of the position, as the tracker's covariance has it.");
  add_unused(report, track, summary);
}

void add_rgbd_recording_section(HtmlReport& report, const RecordingInfo& info) {
  report.begin_section("Recording");
  report.add_table(
      {"what", "value"},
      {{"folder", info.path.string()},
       {"kind", std::string(to_string(info.kind))},
       {"depth images", std::to_string(info.frame_count)},
       {"with colour", std::to_string(info.paired_count)},
       {"camera", fmt::format("{} x {}, fx {:.2f} fy {:.2f} cx {:.2f} cy {:.2f} ({})", info.camera.width,
                              info.camera.height, info.camera.fx, info.camera.fy, info.camera.cx,
                              info.camera.cy, info.camera_source)}});
}

JsonValue tracking_series_json(const VisualTrack& track) {
  auto json = JsonValue::object();
  json["frame"] = JsonValue::array_of(
      series_of(track, {}, [](const VisualFrame& f) { return static_cast<double>(f.index); }).y);
  const auto add = [&](const char* key, Getter get) {
    json[key] = JsonValue::array_of(series_of(track, {}, get).y);
  };
  for (const Part& stage : kStages) add(stage.key, stage.get);
  add("total_ms", total_ms_of);
  for (const Part& count : kCounts) add(count.key, count.get);
  add("model_points", model_points_of);
  auto status = JsonValue::array();
  for (const VisualFrame& frame : track.frames)
    if (frame.status != TrackingStatus::kSkipped)
      status.push_back(frame.numbers.by_depth ? "tracked by depth" : to_string(frame.status));
  json["status"] = std::move(status);
  return json;
}

std::string odometry_report_html(const OdometrySummary& summary, const OdometryReportMaterial& material) {
  const VisualTrack& track = summary.track;
  HtmlReport report(folder_title(summary.recording.path), "Odometry");
  const SummaryTree tree = describe(summary);
  report.set_verdict(
      report_verdict(summary.verdict),
      verdict_sentence(
          summary.verdict,
          *tree.sentence(
              "{frames.tracked} of {frames.total|frame} have a pose, over a path of {path_length_m}[; it is "
              "off by {ate_rmse_m} (rmse against the recording's own poses)].")));
  add_error_cards(report, tree);
  add_tracking_cards(report, tree);
  add_warnings_section(report, summary.warnings);
  add_path_section(report, summary);
  add_visits_section(report, summary.verdict);
  add_tracking_sections(report, track, tree);
  add_rgbd_recording_section(report, summary.recording);
  return page_with_parameters(report, material.parameters_toml, material.program_version);
}

JsonValue odometry_report_json(const OdometrySummary& summary, const std::string& program_version) {
  auto json = to_json(summary);
  json["version"] = program_version;
  json["recording"] = summary.recording.path.string();
  json["warnings"] = JsonValue::array_of(summary.warnings);
  json["series"] = tracking_series_json(summary.track);
  return json;
}

}  // namespace hm
