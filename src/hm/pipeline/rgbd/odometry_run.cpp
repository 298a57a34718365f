#include "hm/pipeline/rgbd/odometry_run.hpp"

#include "hm/core/stopwatch.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/pipeline/checks/preflight.hpp"
#include "hm/pipeline/common/frame_range.hpp"
#include "hm/pipeline/common/sensor_prior.hpp"
#include "hm/pipeline/common/truth_comparison.hpp"
#include "hm/pipeline/live/live_view.hpp"
#include "hm/pipeline/rgbd/odometry_report.hpp"
#include "hm/pipeline/rgbd/tracking_view.hpp"
#include "hm/pipeline/verdict/depth_visits.hpp"
#include "hm/report/run_report.hpp"

namespace hm {
namespace {

void show_progress(const RunContext& run, const VisualTrack& track) {
  if (!run.progress) return;
  const double last_ms = track.frames.empty() ? 0 : track.frames.back().numbers.total_ms;
  run.progress({"tracking", track.frames_read + track.unused.size(), track.frames_total,
                fmt::format("{}, {}, {:.1f} ms, {} lost", counted(track.keyframes.size(), "keyframe"),
                            counted(track.model_points, "point"), last_ms, track.frames_lost)});
}

/// Tracks the frames one by one; true when it was stopped before the end.
bool track_all(const Recording& recording, const OdometryRunOptions& options, VisualTracking& tracking) {
  const FrameRange range = frame_range(options.parameters.reconstruction, recording.info().frame_count);
  FramePrefetcher frames(recording, range.begin, range.end, range.stride,
                         prefetch_options(options.parameters.reconstruction, options.run.threads));
  std::size_t index = range.begin;
  while (!options.run.stop.stop_requested()) {
    const Stopwatch wait;
    const auto frame = frames.next();
    if (!frame) return false;
    const TrackedFrame tracked = tracking.take(index, *frame, wait.milliseconds());
    show_tracked(options.run, tracking, recording.camera(), *frame ? &**frame : nullptr,
                 tracked.T_odom_camera);
    index += range.stride;
    show_progress(options.run, tracking.track());
  }
  return index < range.end;
}

Result<void> write_odometry_results(const OdometryRunOptions& options, const std::filesystem::path& folder,
                                    OdometrySummary& summary) {
  RgbdParameters parameters = options.parameters;
  const std::string parameters_toml = list_odometry(parameters).to_toml();
  if (const auto written = write_tum_trajectory(folder / "trajectory.tum", summary.track.trajectory);
      !written)
    return written;
  if (const auto written = write_file_text(folder / "parameters.toml", parameters_toml); !written)
    return written;
  for (const char* name : {"trajectory.tum", "parameters.toml", "report.json", "report.html"})
    summary.outputs.push_back(folder / name);
  const std::string json = to_json_text(odometry_report_json(summary, options.run.program_version));
  if (const auto written = write_file_text(folder / "report.json", json + "\n"); !written) return written;
  const OdometryReportMaterial material{options.run.program_version, parameters_toml};
  return write_file_text(folder / "report.html", odometry_report_html(summary, material));
}

}  // namespace

namespace {

void judge_odometry(const Recording& recording, const OdometryRunOptions& options, OdometrySummary& summary) {
  judge_depth_visits(recording, summary.track.trajectory, options.run, summary.verdict);
  judge_tracking(summary.track, summary.verdict);
  if (summary.track.submaps > 1)
    summary.verdict.add(MapVerdict::kBroken,
                        fmt::format("the trajectory has {} disconnected pieces", summary.track.submaps));
}

}  // namespace

SE3 level_camera() {
  Mat3 R_odom_camera;  // x right, y down, z forward as seen from x forward, y left, z up
  R_odom_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {R_odom_camera, Vec3::Zero()};
}

Result<OdometrySummary> run_odometry(const OdometryRunOptions& options) {
  if (const auto checked = check_parameters(options.parameters); !checked) return forward_error(checked);
  auto folder = ResultFolder::open(
      {options.output, options.existing, "odometry", options.recording, options.run.program_version});
  if (!folder) return forward_error(folder);
  auto recording = open_recording(options.recording, options.recording_options);
  if (!recording) return forward_error(recording);
  auto checked_recording =
      check_before_run(*recording, {.poses = PoseUse::kComparesWith,
                                    .force = options.force,
                                    .register_color = options.parameters.reconstruction.register_color,
                                    .needs_color = needs_color(options.parameters.odometry)});
  if (!checked_recording) return forward_error(checked_recording);
  const RecordingInfo& info = (*recording)->info();
  const FrameRange range = frame_range(options.parameters.reconstruction, info.frame_count);
  VisualTracking tracking(options.parameters.odometry, info.camera.without_distortion(),
                          {range.count(), level_camera(), info.imu, is_from_kinect(info)});
  OdometrySummary summary;
  const Stopwatch watch;
  summary.interrupted = track_all(**recording, options, tracking);
  summary.run_s = watch.seconds();
  summary.track = tracking.finish();
  summary.recording = info;
  summary.parameters = options.parameters;
  if (summary.track.trajectory.empty()) {
    if (summary.interrupted)
      return fail(ErrorCode::kCancelled, {}, "stopped before the first frame had a pose");
    return fail(ErrorCode::kInvalidValue, options.recording.string(), "{}",
                why_no_pose(summary.track, checked_recording->warnings));
  }
  summary.warnings = std::move(checked_recording->warnings);
  add_doubts(std::move(checked_recording->doubts), summary.verdict);
  for (std::string& warning : warnings_of(summary.track)) summary.warnings.push_back(std::move(warning));
  if (summary.interrupted)
    summary.warnings.push_back(fmt::format("stopped after {} of {}",
                                           with_thousands(summary.track.frames_read),
                                           counted(summary.track.frames_total, "frame")));
  judge_odometry(**recording, options, summary);
  if (options.run.view) options.run.view->on_end(summary.verdict);
  summary.error = compare_with_truth(summary.track.trajectory, info, options.parameters.trajectory_error,
                                     summary.warnings);
  const auto written = as_run_failure(write_odometry_results(options, folder->staging(), summary));
  if (!written) return forward_error(written);
  const auto published =
      folder->publish(summary.outputs, summary.interrupted ? RunState::kStopped : RunState::kComplete);
  if (!published) return forward_error(published);
  return summary;
}

void visit(const OdometrySummary& summary, SummaryTree& v) {
  v.group("verdict", summary.verdict);
  v({"method"}, kOdometryMethodNames[static_cast<std::size_t>(summary.parameters.odometry.method)]);
  visit(summary.track, v);
  v.json("loops", JsonValue::object({{"candidates", 0}, {"accepted", 0}}));  // odometry looks for none
  if (summary.error) visit_error(*summary.error, v);
  v({"interrupted"}, summary.interrupted);
  v({"run_s", "time", "{:.1f} s"}, summary.run_s);
}

std::string to_text(const OdometrySummary& summary) {
  const SummaryTree tree = describe(summary);
  return tracking_lines(tree) +
         tree.lines({"verdict   {verdict.text}",
                     "error     ATE {ate_rmse_m}[, RPE {rpe_frame_m} a frame][, {rpe_second_m} and "
                     "{rpe_second_rad} a second]"}) +
         output_lines(summary.outputs);
}

}  // namespace hm
