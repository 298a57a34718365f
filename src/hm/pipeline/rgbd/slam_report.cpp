#include "hm/pipeline/rgbd/slam_report.hpp"

#include <array>
#include <map>

#include "hm/pipeline/rgbd/odometry_report.hpp"
#include "hm/pipeline/rgbd/slam_alignment.hpp"
#include "hm/report/path_plots.hpp"
#include "hm/report/plot.hpp"
#include "hm/report/run_report.hpp"

namespace hm {
namespace {

/// Frames that kept odometry's motion.
std::map<AlignmentStatus, std::size_t> refused(const SlamAlignmentSummary& summary) {
  std::map<AlignmentStatus, std::size_t> counts;
  for (const SlamAlignedFrame& frame : summary.frames)
    if (frame.status != AlignmentStatus::kAccepted) ++counts[frame.status];
  return counts;
}

Summary moved_m(const SlamAlignmentSummary& summary) {
  std::vector<double> shifts;
  for (const SlamAlignedFrame& frame : summary.frames)
    if (frame.status == AlignmentStatus::kAccepted) shifts.push_back(frame.shift_m);
  return summarise(shifts);
}

PlotSeries series_of(const SlamAlignmentSummary& summary, const char* name,
                     double SlamAlignedFrame::*member) {
  PlotSeries series{name, {}, {}, SeriesStyle::kLine};
  for (const SlamAlignedFrame& frame : summary.frames) {
    series.x.push_back(static_cast<double>(frame.index));
    series.y.push_back(frame.*member * 1e3);
  }
  return series;
}

void add_cards(HtmlReport& report, const SlamSummary& summary) {
  const SlamPipeline::State& state = summary.state;
  add_tracking_cards(report, state.track);
  report.add_card({"loops",
                   std::to_string(state.loops.accepted),
                   {},
                   fmt::format("of {} candidates; largest correction {:.2f} m", state.loops.candidates,
                               state.largest_shift_m)});
  add_error_cards(report, summary.error);
  if (summary.mesh_error)
    report.add_card({"surface error",
                     fmt::format("{:.1f}", summary.mesh_error->accuracy.distance_m.mean * 1e3), "mm",
                     "mean distance from the true surface"});
}

void add_path(HtmlReport& report, const SlamSummary& summary) {
  report.begin_section("Path");
  const SlamPipeline::State& state = summary.state;
  if (!summary.error || !summary.odometry_error) {
    const std::array<NamedTrajectory, 2> paths{
        {{"corrected", &state.corrected}, {"odometry", &state.track.trajectory}}};
    return add_path_views(report, paths, "Before and after loops were closed.");
  }
  const Trajectory truth = matched_truth(*summary.error), corrected = matched_estimate(*summary.error),
                   odometry = matched_estimate(*summary.odometry_error);
  const std::array<NamedTrajectory, 3> paths{
      {{"truth", &truth}, {"corrected", &corrected}, {"odometry", &odometry}}};
  add_path_views(report, paths, "Each is fitted to the recording's own poses.");
  report.begin_section("Error", "Of the corrected trajectory, against the recording's own poses.");
  report.add_table({"trajectory", "ATE (m)", "largest (m)"},
                   {{"odometry", fmt::format("{:.4f}", summary.odometry_error->position_m.rmse),
                     fmt::format("{:.4f}", summary.odometry_error->position_m.max)},
                    {"corrected", fmt::format("{:.4f}", summary.error->position_m.rmse),
                     fmt::format("{:.4f}", summary.error->position_m.max)}});
  add_relative_table(report, *summary.error);
  add_error_plots(report, *summary.error);
}

void add_loops(HtmlReport& report, const SlamSummary& summary, const SlamReportMaterial& material) {
  const SlamPipeline::State& state = summary.state;
  const RgbdLoopStatistics& loops = state.loops;
  report.begin_section("Loops", "Places that were seen again, on a thread of its own.");
  const auto count = [](std::size_t number) { return std::to_string(number); };
  report.add_table({"what", "number"}, {{"keyframes", count(state.track.keyframes.size())},
                                        {"candidates", count(loops.candidates)},
                                        {"accepted", count(loops.accepted)},
                                        {"no motion explains the matches", count(loops.not_verified)},
                                        {"further off than odometry can be", count(loops.too_far)},
                                        {"ambiguous", count(loops.ambiguous)},
                                        {"not confirmed by another", count(loops.unconfirmed)},
                                        {"taken out again", count(loops.taken_out)},
                                        {"submaps", count(loops.submaps)},
                                        {"maps after connecting", count(loops.maps)}});
  if (state.alignment.adjusted)
    report.add_paragraph(fmt::format(
        "Bundle adjustment of {} landmarks: {:.2f} px before, {:.2f} px after. Features were matched {} "
        "times where loops closed, {} times between other visits of a place.",
        state.alignment.landmarks, state.alignment.error_before_px, state.alignment.error_after_px,
        state.alignment.loop_links, state.alignment.visit_links));
  for (const Figure& figure : material.matrices) add_figure(report, figure);
}

std::string mm(const std::optional<MeshError>& error) {
  return error ? fmt::format("{:.2f}", error->accuracy.distance_m.mean * 1e3) : std::string("-");
}
std::string percent(const std::optional<MeshError>& error) {
  return error ? fmt::format("{:.1f}", error->completeness.ratio * 100) : std::string("-");
}

/// Corrections while tracking: when, how much, how far, how long.
void add_live_corrections(HtmlReport& report, const SlamPipeline::State& state) {
  if (state.live_corrections.empty()) return;
  report.add_paragraph(fmt::format(
      "While tracking went on, what loops had moved was rebuilt beside the map {} times and then put "
      "in its place; tracking waited {:.1f} ms at most for one of them.",
      state.live_corrections.size(), longest_stall_ms(state)));
  std::vector<std::vector<std::string>> rows;
  for (const LiveCorrection& live : state.live_corrections)
    rows.push_back({std::to_string(live.frame_index),
                    fmt::format("{:.1f}", (live.stamp - live.begun).seconds()),
                    std::to_string(live.map.frames_moved), std::to_string(live.map.frames_replayed),
                    fmt::format("{} of {}", live.map.volumes_rebuilt, live.map.volumes_before),
                    fmt::format("{:.3f}", live.map.largest_shift_m), fmt::format("{:.2f}", live.map.seconds),
                    fmt::format("{:.1f}", live.stall_ms)});
  report.add_table({"in place at frame", "after (s of the recording)", "frames moved", "others replayed",
                    "volumes rebuilt", "largest shift at 3 m (m)", "rebuilt in (s)", "tracking waited (ms)"},
                   rows);
}

void add_map(HtmlReport& report, const SlamSummary& summary, const SlamReportMaterial& material) {
  const MapCorrection& correction = summary.state.correction;
  report.begin_section(
      "Map",
      fmt::format(
          "At the end, {} of {} volumes were rebuilt from the recording in {:.1f} s: {} frames had moved "
          "(by up to {:.3f} m at a depth of 3 m), {} others had seen the same.",
          correction.volumes_rebuilt, correction.volumes_before, correction.seconds, correction.frames_moved,
          correction.largest_shift_m, correction.frames_replayed));
  add_live_corrections(report, summary.state);
  if (summary.mesh_error)
    report.add_table(
        {"mesh", "mean distance from the true surface (mm)", "complete (%)"},
        {{"with odometry's poses", mm(summary.odometry_mesh_error), percent(summary.odometry_mesh_error)},
         {"with corrected poses", mm(summary.mesh_error), percent(summary.mesh_error)}});
  for (const Figure& figure : material.figures) add_figure(report, figure);
  if (!material.maps.empty()) report.begin_section("Maps of keyframes");
  for (const Figure& figure : material.maps) add_figure(report, figure);
}

}  // namespace

JsonValue to_json(const SlamAlignmentSummary& summary) {
  auto json = JsonValue::object({{"accepted", summary.accepted}, {"not_accepted", summary.not_accepted}});
  auto reasons = JsonValue::object();
  for (const auto& [status, frames] : refused(summary)) reasons[std::string(to_string(status))] = frames;
  json["refused"] = std::move(reasons);
  const Summary moved = moved_m(summary);
  json["moved_m"] = JsonValue::object({{"median", moved.median}, {"p99", moved.p99}, {"max", moved.max}});
  json["mean_ms"] = summary.milliseconds.mean;
  json["p99_ms"] = summary.milliseconds.p99;
  return json;
}

void add_alignment_section(HtmlReport& report, const SlamAlignmentSummary& summary) {
  const Summary moved = moved_m(summary);
  report.begin_section(
      "Dense alignment",
      fmt::format(
          "{} of {} depth images were aligned to what was seen just before them, and moved their "
          "camera by {:.1f} mm (median; {:.1f} mm at most); {:.1f} ms a frame (99 % under {:.1f} ms). "
          "Odometry, above and below, is what alignment made of it.",
          summary.accepted, summary.frames.size(), moved.median * 1e3, moved.max * 1e3,
          summary.milliseconds.mean, summary.milliseconds.p99));
  if (summary.frames.empty()) return;
  std::vector<std::vector<std::string>> rows{{"aligned", std::to_string(summary.accepted), ""}};
  for (const auto& [status, frames] : refused(summary))
    rows.push_back({std::string(to_string(status)), std::to_string(frames), summary.first_reason.at(status)});
  report.add_table({"outcome", "frames", "the first, why"}, rows);
  const std::array<PlotSeries, 2> distances{series_of(summary, "before", &SlamAlignedFrame::rms_before_m),
                                            series_of(summary, "after", &SlamAlignedFrame::rms_after_m)};
  add_frame_plot(report, distances, "distance (mm)",
                 "Distance of the depth images from what was seen before (rms of what agrees).");
  const std::array<PlotSeries, 2> moves{series_of(summary, "by this image", &SlamAlignedFrame::shift_m),
                                        series_of(summary, "in all", &SlamAlignedFrame::drift_m)};
  add_frame_plot(report, moves, "moved (mm)",
                 "How far each image moved its camera, and how far all so far have.");
}

std::string slam_report_html(const SlamSummary& summary, const SlamReportMaterial& material) {
  using Verdict = HtmlReport::Verdict;
  const SlamPipeline::State& state = summary.state;
  HtmlReport report("SLAM of " + summary.recording.path.filename().string());
  report.set_verdict(
      summary.warnings.empty() ? Verdict::kGood : Verdict::kDoubtful,
      fmt::format("{} of {} frames are in the map, over a path of {:.1f} m; {} loops were closed.",
                  state.corrected.size(), state.frames_total, path_length(state.corrected),
                  state.loops.accepted));
  add_cards(report, summary);
  add_warnings_section(report, summary.warnings);
  add_map(report, summary, material);
  add_path(report, summary);
  if (state.dense_alignment) add_alignment_section(report, *state.dense_alignment);
  add_loops(report, summary, material);
  add_tracking_sections(report, state.track);
  add_rgbd_recording_section(report, summary.recording);
  return page_with_parameters(report, material.parameters_toml, material.program_version);
}

JsonValue slam_report_json(const SlamSummary& summary, const std::string& program_version) {
  auto json = to_json(summary);
  json["version"] = program_version;
  json["recording"] = summary.recording.path.string();
  json["warnings"] = JsonValue::array_of(summary.warnings);
  json["series"] = tracking_series_json(summary.state.track);
  return json;
}

}  // namespace hm
