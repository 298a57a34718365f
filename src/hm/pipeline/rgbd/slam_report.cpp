#include "hm/pipeline/rgbd/slam_report.hpp"

#include <array>
#include <map>

#include "hm/core/text/counted.hpp"
#include "hm/pipeline/rgbd/odometry_report.hpp"
#include "hm/pipeline/rgbd/slam_alignment.hpp"
#include "hm/report/path_plots.hpp"
#include "hm/report/plot.hpp"
#include "hm/report/run_report.hpp"
#include "hm/report/trajectory_plots.hpp"

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

void add_key_numbers(HtmlReport& report, const SummaryTree& summary) {
  add_error_cards(report, summary);
  add_cards(report, summary,
            {{"surface error", "{mesh_error.accuracy_mm.mean}", "mean distance from the true surface"}});
  add_cards(report, summary,
            {{"loops", "{loops.accepted}",
              "of {loops.candidates|candidate}; largest correction "
              "{largest_correction_m}"}});
  add_tracking_cards(report, summary);
}

void add_path(HtmlReport& report, const SlamSummary& summary) {
  report.begin_section("Path");
  const SlamPipeline::State& state = summary.state;
  if (!summary.error || !summary.odometry_error) {
    const std::array<NamedTrajectory, 2> paths{
        {{"corrected", &state.corrected}, {"odometry", &state.track.trajectory}}};
    add_path_views(report, paths, "Before and after loops were closed.");
    return add_motion_plots(report, paths);
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
  add_error_statistics(report, *summary.error);
  add_error_path(report, *summary.error);
  add_position_histogram(report, *summary.error);
  add_error_plots(report, *summary.error);
  add_relative_table(report, *summary.error);
  report.begin_section("Pose over time", "Each is fitted to the recording's own poses.");
  add_pose_components(report, *summary.error);
  const std::array<NamedTrajectory, 1> whole{{{"corrected", &state.corrected}}};
  add_motion_plots(report, whole);
}

void add_loops(HtmlReport& report, const SummaryTree& summary, const SlamReportMaterial& material) {
  report.begin_section("Loops", "Places that were seen again, on a thread of its own.");
  add_summary_table(report, summary, "loops");
  if (const auto adjustment = summary.sentence(
          "Bundle adjustment of {bundle_adjustment.landmarks|landmark}: reprojection error "
          "{bundle_adjustment.error_before_px} before, {bundle_adjustment.error_after_px} after. It used "
          "{bundle_adjustment.loop_links|feature match|feature matches} from closed loops and "
          "{bundle_adjustment.visit_links} between other visits of a place."))
    report.add_paragraph(*adjustment);
  add_loop_figures(report, material.loops);
}

/// The matrices of place recognition, for those who look into loops.
void add_matrices(HtmlReport& report, const SlamReportMaterial& material) {
  if (material.matrices.empty()) return;
  report.begin_section("Matrices of place recognition");
  for (const Figure& figure : material.matrices) add_figure(report, figure);
}

/// First sentence of the report: contents and quality of the result.
std::string verdict_of(const SlamSummary& summary, const SummaryTree& tree,
                       const std::optional<SceneSize>& size) {
  const SlamPipeline::State& state = summary.state;
  const std::string what = size ? to_text(*size) + ". " : std::string();
  const std::string error =
      tree.sentence("; the path is off by {ate_rmse_m} (rmse against the recording's own poses)")
          .value_or("");
  return what + fmt::format("{} of {} are in the map, over a path of {:.1f} m; {} closed{}.",
                            with_thousands(state.corrected.size()), counted(state.frames_total, "frame"),
                            path_length(state.corrected), counted(state.loops.accepted, "loop"), error);
}

/// Adds when the map was corrected while tracking, how much of it, how far, how long.
void add_live_corrections(HtmlReport& report, const SlamPipeline::State& state, const SummaryTree& summary) {
  if (state.live_corrections.empty()) return;
  report.add_paragraph(*summary.sentence(
      "During tracking, the parts of the map that closed loops had moved were rebuilt in a copy, which then "
      "replaced the map, {corrections|time}; tracking waited for this {longest_stall_ms} at most."));
  add_list_table(report, summary, "live_corrections");
}

void add_map(HtmlReport& report, const SlamSummary& slam, const SummaryTree& summary,
             const SlamReportMaterial& material) {
  report.begin_section(
      "Map",
      *summary.sentence(
          "At the end, {map_correction.volumes_rebuilt} of {map_correction.volumes_before|block} of voxels "
          "were "
          "rebuilt from the recording in {map_correction.seconds}: the poses of "
          "{map_correction.frames_moved|frame} had moved (by up to {map_correction.largest_shift_m} at a "
          "depth of 3 m), and {map_correction.frames_replayed} others had seen the same blocks."));
  add_live_corrections(report, slam.state, summary);
  SummaryTree::Rows meshes;
  for (const auto& [name, key] : {std::pair{"with odometry's poses", "odometry_mesh_error"},
                                  std::pair{"with corrected poses", "mesh_error"}})
    if (const auto mean = summary.sentence(fmt::format("{{{}.accuracy_mm.mean}}", key)))
      meshes.push_back({name, *mean, *summary.sentence(fmt::format("{{{}.completeness_ratio}}", key))});
  if (!meshes.empty()) report.add_table({"mesh", "mean distance from the true surface", "complete"}, meshes);
  for (const Figure& figure : material.figures) add_figure(report, figure);
  add_floor_plan(report, material.scene);
  if (!material.maps.empty()) report.begin_section("Maps of keyframes");
  for (const Figure& figure : material.maps) add_figure(report, figure);
}

}  // namespace

void visit(const SlamAlignmentSummary& summary, SummaryTree& v) {
  v({"accepted", "frames aligned"}, summary.accepted);
  v({"not_accepted", "frames not aligned"}, summary.not_accepted);
  v.object("refused", [&](SummaryTree& reasons) {
    for (const auto& [status, frames] : refused(summary)) reasons({to_string(status)}, frames);
  });
  v.spread({"moved_m", "moved", "{:.1f} mm", 1e3}, moved_m(summary), {"median", "p99", "max"});
  v({"mean_ms", "a frame, mean", "{:.1f} ms"}, summary.milliseconds.mean);
  v({"p99_ms", "a frame, 99 % under", "{:.1f} ms"}, summary.milliseconds.p99);
}

void add_alignment_section(HtmlReport& report, const SlamAlignmentSummary& summary) {
  report.begin_section(
      "Dense alignment",
      *describe(summary).sentence(
          "{accepted|depth image} aligned to what was seen just before, {not_accepted} not; "
          "alignment moved their cameras by {moved_m.median} (median; {moved_m.max} at most), in {mean_ms} a "
          "frame (99 % under {p99_ms}). Odometry, above and below, is odometry after alignment."));
  if (summary.frames.empty()) return;
  std::vector<std::vector<std::string>> rows{{"aligned", with_thousands(summary.accepted), ""}};
  for (const auto& [status, frames] : refused(summary))
    rows.push_back({std::string(to_string(status)), with_thousands(frames), summary.first_reason.at(status)});
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
  const SlamPipeline::State& state = summary.state;
  const SummaryTree tree = describe(summary);
  HtmlReport report(folder_title(summary.recording.path), summary.capture ? "Scan" : "SLAM");
  report.set_verdict(report_verdict(summary.verdict),
                     verdict_sentence(summary.verdict, verdict_of(summary, tree, material.scene.size)));
  report.set_model(material.scene.model_html);
  add_key_numbers(report, tree);
  if (const auto resumed = tree.sentence("The run was resumed at frame {resumed_at_frame}."))
    report.add_paragraph(*resumed);
  add_warnings_section(report, summary.warnings);
  add_map(report, summary, tree, material);
  add_path(report, summary);
  add_visits_section(report, summary.verdict);
  if (state.dense_alignment) add_alignment_section(report, *state.dense_alignment);
  add_loops(report, tree, material);
  if (summary.capture) {
    report.begin_section("Camera", "What became of the frames of the camera.");
    add_summary_table(report, tree, "capture");
  }
  add_tracking_sections(report, state.track, tree);
  add_matrices(report, material);
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
