#include "hm/pipeline/rgbd/odometry_report.hpp"

#include <array>
#include <numbers>

#include "hm/report/plot.hpp"
#include "hm/report/path_plots.hpp"
#include "hm/report/run_report.hpp"

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
  const char* name;
  Getter get;
};
constexpr std::array<Part, 4> kStages{
    {{"features", [](const VisualFrame& f) { return f.numbers.features_ms; }},
     {"prediction", [](const VisualFrame& f) { return f.numbers.prediction_ms; }},
     {"registration", [](const VisualFrame& f) { return f.numbers.registration_ms; }},
     {"model", [](const VisualFrame& f) { return f.numbers.model_ms; }}}};
constexpr std::array<Part, 4> kCounts{
    {{"features", [](const VisualFrame& f) { return static_cast<double>(f.numbers.features); }},
     {"of them with depth",
      [](const VisualFrame& f) { return static_cast<double>(f.numbers.features_with_depth); }},
     {"matches", [](const VisualFrame& f) { return static_cast<double>(f.numbers.matches); }},
     {"inliers", [](const VisualFrame& f) { return static_cast<double>(f.numbers.inliers); }}}};

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

void add_inertial(HtmlReport& report, const VisualTrack& track) {
  if (track.imu_source.empty()) return;
  report.begin_section("Inertial device", "What was carried along with the camera, and what became of it.");
  report.add_table(
      {"what", "value"},
      {{"readings", track.imu_source},
       {"frames whose turn a gyroscope predicted", std::to_string(track.turns_given)},
       {"frames whose roll and pitch gravity helped to hold", std::to_string(track.gravity_used)},
       {"frames whose readings did not fit and were not used", std::to_string(track.gravity_rejected)}});
}

void add_lost(HtmlReport& report, const VisualTrack& track) {
  if (track.lost.empty()) return;
  report.begin_section("Lost", "Stretches without a pose; the model is not touched by them.");
  std::vector<std::vector<std::string>> rows;
  constexpr std::size_t kMost = 100;
  for (std::size_t i = 0; i < std::min(kMost, track.lost.size()); ++i) {
    const LostStretch& stretch = track.lost[i];
    rows.push_back({std::to_string(stretch.first_frame), std::to_string(stretch.frames),
                    fmt::format("{:.2f}", stretch.duration_s), stretch.reason});
  }
  report.add_table({"first frame", "frames", "time (s)", "reason"}, rows);
  if (track.lost.size() > kMost) report.add_paragraph(fmt::format("and {} more", track.lost.size() - kMost));
}

void add_unused(HtmlReport& report, const VisualTrack& track) {
  if (track.unused.empty()) return;
  report.begin_section("Unused frames");
  std::vector<std::vector<std::string>> rows;
  constexpr std::size_t kMost = 50;
  for (std::size_t i = 0; i < std::min(kMost, track.unused.size()); ++i)
    rows.push_back({std::to_string(track.unused[i].index), track.unused[i].reason});
  report.add_table({"frame", "reason"}, rows);
  if (track.unused.size() > kMost)
    report.add_paragraph(fmt::format("and {} more", track.unused.size() - kMost));
}

void add_path_section(HtmlReport& report, const OdometrySummary& summary) {
  report.begin_section("Path");
  if (!summary.error) {
    const std::array<NamedTrajectory, 1> paths{{{"odometry", &summary.track.trajectory}}};
    return add_path_views(report, paths, {});
  }
  const Trajectory truth = matched_truth(*summary.error), estimate = matched_estimate(*summary.error);
  const std::array<NamedTrajectory, 2> paths{{{"truth", &truth}, {"odometry", &estimate}}};
  add_path_views(report, paths, "Odometry is fitted to the recording's own poses.");
  report.begin_section("Error", "Against the recording's own poses, which tracking does not see.");
  add_relative_table(report, *summary.error);
  add_error_plots(report, *summary.error);
}

}  // namespace

void add_tracking_cards(HtmlReport& report, const VisualTrack& track) {
  report.add_card({"frames",
                   std::to_string(track.frames_tracked),
                   {},
                   fmt::format("of {} have a pose; {} lost", track.frames_total, track.frames_lost)});
  report.add_card({"tracking", fmt::format("{:.1f}", track.track_ms.mean), "ms",
                   fmt::format("a frame, mean; 99 % under {:.1f} ms", track.track_ms.p99)});
  report.add_card({"path", fmt::format("{:.1f}", path_length(track.trajectory)), "m",
                   fmt::format("{} keyframes", track.keyframes.size())});
}

void add_error_cards(HtmlReport& report, const std::optional<TrajectoryError>& error) {
  if (!error) return;
  report.add_card({"ATE", fmt::format("{:.1f}", error->position_m.rmse * 1e2), "cm", "rmse of the position"});
  if (!error->per_second.spans.empty())
    report.add_card({"RPE", fmt::format("{:.1f}", error->per_second.translation_m.rmse * 1e2), "cm",
                     fmt::format("a second, rmse; {:.2f} deg",
                                 error->per_second.rotation_rad.rmse * 180 / std::numbers::pi)});
}

void add_tracking_sections(HtmlReport& report, const VisualTrack& track) {
  add_lost(report, track);
  add_inertial(report, track);
  add_sizes(report, track);
  add_times(report, track);
  report.begin_section("Images and certainty");
  add_one(report, series_of(track, "sharpness", sharpness_of), "variance of the Laplacian",
          "Sharpness of the colour image: low where it is blurred, dark or bare.");
  add_one(report, series_of(track, "depth", coverage_of), "pixels with depth (%)",
          "Coverage of the depth image.");
  add_one(report, series_of(track, "position", sigma_mm_of), "standard deviation (mm)",
          "Of the position, as the tracker's covariance has it.");
  add_unused(report, track);
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
  for (const Part& part : kStages)
    json[std::string(part.name) + "_ms"] = JsonValue::array_of(series_of(track, {}, part.get).y);
  json["total_ms"] = JsonValue::array_of(series_of(track, {}, total_ms_of).y);
  json["features"] = JsonValue::array_of(series_of(track, {}, kCounts[0].get).y);
  json["features_with_depth"] = JsonValue::array_of(series_of(track, {}, kCounts[1].get).y);
  json["matches"] = JsonValue::array_of(series_of(track, {}, kCounts[2].get).y);
  json["inliers"] = JsonValue::array_of(series_of(track, {}, kCounts[3].get).y);
  json["model_points"] = JsonValue::array_of(series_of(track, {}, model_points_of).y);
  auto status = JsonValue::array();
  for (const VisualFrame& frame : track.frames)
    if (frame.status != TrackingStatus::kSkipped) status.push_back(to_string(frame.status));
  json["status"] = std::move(status);
  return json;
}

std::string odometry_report_html(const OdometrySummary& summary, const OdometryReportMaterial& material) {
  using Verdict = HtmlReport::Verdict;
  const VisualTrack& track = summary.track;
  HtmlReport report("Odometry of " + summary.recording.path.filename().string());
  report.set_verdict(track.frames_lost == 0 && summary.warnings.empty() ? Verdict::kGood : Verdict::kDoubtful,
                     fmt::format("{} of {} frames have a pose, over a path of {:.2f} m.",
                                 track.frames_tracked, track.frames_total, path_length(track.trajectory)));
  add_tracking_cards(report, track);
  add_error_cards(report, summary.error);
  add_warnings_section(report, summary.warnings);
  add_path_section(report, summary);
  add_tracking_sections(report, track);
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
