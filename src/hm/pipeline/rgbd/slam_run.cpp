#include "hm/pipeline/rgbd/slam_run.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "hm/core/angle.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/pipeline/checks/preflight.hpp"
#include "hm/pipeline/common/box_json.hpp"
#include "hm/pipeline/common/frame_range.hpp"
#include "hm/pipeline/common/mesh_evaluation.hpp"
#include "hm/pipeline/common/scene_level.hpp"
#include "hm/pipeline/rgbd/resume/earlier_map.hpp"
#include "hm/pipeline/rgbd/slam_finish.hpp"
#include "hm/pipeline/rgbd/slam_report.hpp"
#include "hm/pipeline/rgbd/slam_save.hpp"
#include "hm/report/run_report.hpp"

namespace hm {
namespace {

/// Where the run begins: the saved state of an earlier one, if it is resumed and has one.
Result<std::optional<SavedSlam>> saved_run(const ResultFolder& folder, const Recording& recording,
                                           const SlamRunOptions& options) {
  if (!folder.resumed()) return std::nullopt;
  auto saved = read_saved_slam(folder.path());
  if (!saved || !*saved) return saved;
  const auto checked =
      check_continues(**saved, recording.info(), recording.camera(), options.parameters, folder.path());
  if (!checked) return forward_error(checked);
  return saved;
}

void log_start(const SlamRunOptions& options, const std::optional<SavedSlam>& saved, std::size_t map_frames) {
  if (!options.run.log) return;
  if (saved)
    options.run.log(LogLevel::kInfo,
                    fmt::format("the run continues at frame {}", saved->checkpoint.next_frame));
  else
    options.run.log(
        LogLevel::kInfo,
        fmt::format("no state of tracking was saved: it is repeated from the first frame; what was "
                    "saved up to frame {} stays until then",
                    map_frames));
}

/// Prepares a run before its first frame: its saves, and where it continues.
Result<std::unique_ptr<SlamSave>> begin_saves(SlamPipeline& pipeline, ResultFolder& folder,
                                              const Recording& recording, const SlamRunOptions& options,
                                              SlamSummary& summary) {
  auto saved = saved_run(folder, recording, options);
  if (!saved) return forward_error(saved);
  SlamSaveState state =
      initial_save_state(recording.info(), options.run.program_version, options.recording_options);
  if (folder.resumed()) {
    const auto frames = frames_of_saved_slam(folder.path() / "map.hmap", state);
    if (!frames) return forward_error(frames);
    state.next_frame = *frames;
    log_start(options, *saved, *frames);
  }
  if (*saved) {
    if (const auto resumed = pipeline.resume(**saved); !resumed)
      return tl::make_unexpected(cannot_continue(resumed.error()));
    summary.resumed_at_frame = (*saved)->checkpoint.next_frame;
  }
  auto save = std::make_unique<SlamSave>(pipeline, folder, options.parameters, state);
  const auto begun = save->begin_journal(*saved ? &**saved : nullptr);
  if (!begun) return forward_error(begun);
  return save;
}

Result<void> track_and_save(SlamPipeline& pipeline, SlamSave& save) {
  const auto tracked =
      pipeline.track_and_map([&](std::size_t next_frame) { return save.after_frame(next_frame); });
  if (!tracked) return tracked;
  return save.end_of_tracking(pipeline.state().frames_done);
}

/// The saved map that the run is to go on in, if any.
Result<std::optional<EarlierMap>> map_to_continue(const Recording& recording, const SlamRunOptions& options) {
  if (options.continued.empty()) return std::nullopt;
  if (options.existing == ExistingResult::kResume)
    return fail(ErrorCode::kUsage, "--resume", "a run that goes on in a saved map cannot be resumed");
  std::error_code code;
  if (std::filesystem::equivalent(options.continued, options.output, code))
    return fail(ErrorCode::kUsage, options.output.string(),
                "is the map to continue, which stays as it is: choose another folder for the result");
  if (!options.parameters.loops.enabled)
    return fail(ErrorCode::kUsage, "rgbd_loops.enabled",
                "a saved map is recognised by its loops: switch them on");
  const FrameRange range = frame_range(options.parameters.reconstruction, recording.info().frame_count);
  auto earlier = read_earlier_map(options.continued, recording, range.begin);
  if (!earlier) return forward_error(earlier);
  return std::optional<EarlierMap>(std::move(*earlier));
}

/// Runs to the end in the saved map, with its state; the summary then names all files. Nothing is published
/// before, since a map that is not joined yet would not be the map.
Result<void> run_in_map(SlamPipeline& pipeline, const EarlierMap& earlier, const TrackedSlam& run,
                        SlamSummary& summary) {
  const SlamRunOptions& options = run.options;
  if (!pipeline.can_be_saved())
    return fail(ErrorCode::kUsage, "--continue", "needs odometry.method=tracker and slam.align off");
  auto state = JoinedState::begin(earlier, run.staging);
  if (!state) return as_run_failure(Result<void>(forward_error(state)));
  const auto tracked =
      pipeline.track_and_map([&](std::size_t) { return as_run_failure(state->add(pipeline.last_frame())); });
  if (!tracked) return tracked;
  SlamCheckpoint checkpoint = pipeline.checkpoint(pipeline.state().frames_done);
  initial_save_state(run.recording.info(), options.run.program_version, options.recording_options)
      .describe(checkpoint);
  if (const auto finished = finish_slam(run, summary); !finished) return finished;
  checkpoint.places = keyframe_places(*summary.state.keyframes);
  const auto files = as_run_failure(state->finish(std::move(checkpoint)));
  if (!files) return forward_error(files);
  summary.outputs.insert(summary.outputs.end(), files->begin(), files->end());
  return {};
}

/// Runs to the end, with saves on the way; the summary then names all files.
Result<void> run_with_saves(SlamPipeline& pipeline, ResultFolder& folder, const TrackedSlam& run,
                            SlamSummary& summary) {
  const auto save = begin_saves(pipeline, folder, run.recording, run.options, summary);
  if (!save) return forward_error(save);
  if (const auto tracked = track_and_save(pipeline, **save); !tracked) return tracked;
  if (const auto finished = finish_slam(run, summary); !finished) return finished;
  const auto state_files = (*save)->finish(*summary.state.keyframes);
  if (!state_files) return forward_error(state_files);
  summary.outputs.insert(summary.outputs.end(), state_files->begin(), state_files->end());
  return {};
}

}  // namespace

Result<SlamSummary> run_slam(const SlamRunOptions& options) {
  if (const auto checked = check_parameters(options.parameters); !checked) return forward_error(checked);
  if (options.parameters.reconstruction.align)
    return fail(ErrorCode::kUsage, "reconstruction.align",
                "it corrects given poses (hm reconstruct); for those of odometry there is slam.align");
  auto folder = ResultFolder::open(
      {options.output, options.existing, "slam", options.recording, options.run.program_version});
  if (!folder) return forward_error(folder);
  auto recording = open_recording(options.recording, options.recording_options);
  if (!recording) return forward_error(recording);
  auto checked_recording =
      check_before_run(*recording, {.poses = PoseUse::kComparesWith,
                                    .force = options.force,
                                    .register_color = options.parameters.reconstruction.register_color,
                                    .needs_color = needs_color(options.parameters.odometry)});
  if (!checked_recording) return forward_error(checked_recording);
  const Stopwatch watch;
  const auto earlier = map_to_continue(**recording, options);
  if (!earlier) return forward_error(earlier);
  SlamPipeline pipeline(**recording, options.parameters, options.run, *earlier ? &**earlier : nullptr);
  SlamSummary summary;
  summary.warnings = std::move(checked_recording->warnings);
  add_doubts(std::move(checked_recording->doubts), summary.verdict);
  if (*earlier)
    summary.warnings.insert(summary.warnings.end(), (*earlier)->warnings.begin(), (*earlier)->warnings.end());
  const TrackedSlam run{pipeline, **recording, folder->staging(), options, watch};
  const auto done = *earlier ? run_in_map(pipeline, **earlier, run, summary)
                             : run_with_saves(pipeline, *folder, run, summary);
  if (!done) return forward_error(done);
  const auto published =
      folder->publish(summary.outputs, summary.state.interrupted ? RunState::kStopped : RunState::kComplete);
  if (!published) return forward_error(published);
  return summary;
}

void visit(const RgbdLoopStatistics& loops, SummaryTree& v) {
  v({"candidates", "candidates"}, loops.candidates);
  v({"accepted", "accepted"}, loops.accepted);
  v({"not_verified", "no motion explains the matches"}, loops.not_verified);
  v({"too_far", "further off than odometry can be"}, loops.too_far);
  v({"ambiguous", "ambiguous"}, loops.ambiguous);
  v({"unconfirmed", "not confirmed by another"}, loops.unconfirmed);
  v({"removed", "taken out again"}, loops.removed);
  v.shown("submaps", "submaps", loops.submaps);
  v({"maps", "maps after connecting"}, loops.maps);
  v({"solutions", "times solved"}, loops.solutions);
}

void visit(const ContinuedMap& continued, SummaryTree& v) {
  v({"from", "saved map"}, continued.folder.string());
  v({"earlier_keyframes", "keyframes of before"}, continued.earlier_keyframes);
  v({"recognised_at_s", "recognised after", "{:.1f} s"}, continued.recognised_at_s);
  v({"loops", "loops between the recordings"}, continued.loops);
  v({"best_score", "features that agreed at best"}, continued.best.inliers);
  v({"score_needed", "features needed"}, continued.inliers_needed);
}

/// Sentences about bundle adjustment have values only where it was kept.
void visit(const RgbdAlignmentReport& report, SummaryTree& v) {
  v({"adjusted"}, report.adjusted);
  v({"refused"}, report.refused);
  v({"surface_views"}, report.agreement.views);
  if (report.agreement.views > 0) {
    v({"surface_cost_ratio"}, report.agreement.cost / report.agreement.other_cost);
    v({"surface_distance_m", {}, "{:.4f} m"}, report.agreement.distance_m);
    v({"surface_distance_by_depth_m", {}, "{:.4f} m"}, report.agreement.other_distance_m);
    v({"depth_disparity_offset_1_m", {}, "{:.4f} 1/m"}, report.disparity.offset_1_m);
    v({"depth_disparity_offset_sigma_1_m", {}, "{:.4f} 1/m"}, report.disparity.sigma_1_m);
    v({"depth_disparity_cost_ratio"}, report.disparity.cost_ratio);
    v({"depth_disparity_observed"}, report.disparity.is_observed);
    v({"focal_length_ratio"}, report.focal_length.ratio);
    v({"focal_length_ratio_sigma"}, report.focal_length.sigma);
    v({"focal_length_cost_ratio"}, report.focal_length.cost_ratio);
    v({"focal_length_observed"}, report.focal_length.is_observed);
  }
  const auto where_adjusted = [&](const SummaryDoc& doc, auto value) {
    if (report.adjusted)
      v(doc, value);
    else
      v.json(doc.key, value);
  };
  where_adjusted({"loop_links"}, report.loop_links);
  where_adjusted({"visit_links"}, report.visit_links);
  where_adjusted({"landmarks"}, report.landmarks);
  where_adjusted({"observations"}, report.observations);
  v({"observations_behind", "observations behind their camera, left out"}, report.observations_behind);
  v({"interrupted"}, report.interrupted);
  v({"failure"}, report.failure);
  where_adjusted({"error_before_px", {}, "{:.2f} px"}, report.error_before_px);
  where_adjusted({"error_after_px", {}, "{:.2f} px"}, report.error_after_px);
}

void visit(const MapCorrection& correction, SummaryTree& v) {
  v({"frames_moved", "frames moved"}, correction.frames_moved);
  v({"frames_replayed", "others replayed"}, correction.frames_replayed);
  v({"frames_removed", "removed"}, correction.frames_removed);
  v({"volumes_before", "blocks before"}, correction.volumes_before);
  v({"volumes_rebuilt", "rebuilt"}, correction.volumes_rebuilt);
  v({"volumes_after", "after"}, correction.volumes_after);
  v({"largest_shift_m", "largest shift at 3 m", "{:.3f} m"}, correction.largest_shift_m);
  v({"seconds", "rebuilt in", "{:.2f} s"}, correction.seconds);
}

void visit(const LiveCorrection& live, SummaryTree& v) {
  visit(live.map, v);
  v({"frame", "in place at frame", "{:d}"}, live.frame_index);
  v({"after_s", "after (of the recording)", "{:.1f} s"}, (live.stamp - live.begun).seconds());
  v({"stall_ms", "tracking waited", "{:.1f} ms"}, live.stall_ms);
}

std::string drops_text(const CaptureSummary& capture) {
  std::string reasons;
  for (const auto& [reason, frames] : capture.dropped)
    if (frames > 0) reasons += fmt::format("{}{} {}", reasons.empty() ? "" : ", ", reason, frames);
  return reasons;
}

void visit(const CaptureSummary& capture, SummaryTree& v) {
  v({"camera", "camera"}, capture.camera);
  v({"intrinsics", "intrinsics"}, capture.intrinsics);
  v({"exposure", "exposure"}, capture.exposure);
  v({"ended_because", "end"}, capture.ended_because);
  if (capture.earlier_frames > 0) v({"earlier_frames", "frames of before"}, capture.earlier_frames);
  v({"captured", "frames captured"}, capture.captured);
  v({"tracked", "tracked"}, capture.tracked);
  v({"mapped", "of these mapped"}, capture.mapped);
  v({"lost", "lost"}, capture.lost);
  v({"unusable", "not usable"}, capture.unusable);
  std::size_t all = 0;
  for (const auto& [reason, frames] : capture.dropped) all += frames;
  v.object("dropped", [&](SummaryTree& dropped) {
    dropped({"total"}, all);
    for (const auto& [reason, frames] : capture.dropped) dropped({reason}, frames);
  });
  v.shown("drops", "dropped", all == 0 ? "0" : fmt::format("{} ({})", all, drops_text(capture)));
  v({"recorded", "recorded"}, capture.recorded);
  v({"recorded_uncompressed", "of these uncompressed"}, capture.recorded_uncompressed);
  v({"not_recorded", "not recorded"}, capture.not_recorded);
  v({"duration_s", "duration", "{:.1f} s"}, capture.duration_s);
  v({"rate_hz", "tracked a second", "{:.1f}"}, capture.rate_hz);
  v.spread({"latency_ms", "from image to pose", "{:.1f} ms"}, capture.latency_ms,
           {"median", "mean", "p99", "max"});
  v({"saved_s", "saved after", "{:.2f} s"}, capture.saved_s);
}

std::string capture_lines(const SummaryTree& summary) {
  return summary.lines(
      {"camera    {capture.camera}; {capture.ended_because}",
       "frames    {capture.captured|frame} captured in {capture.duration_s}: {capture.tracked} tracked "
       "({capture.mapped} mapped), "
       "{capture.lost} lost, {capture.unusable} not usable, dropped {capture.drops}; {capture.recorded} "
       "recorded[, after {capture.earlier_frames} of before]",
       "latency   {capture.latency_ms.median} from image to pose, 99 % under {capture.latency_ms.p99}",
       "saved     {capture.saved_s} after the last frame"});
}

namespace {

/// Which way is up, and whether the map was levelled by it.
void add_up(const SlamPipeline::State& state, SummaryTree& v) {
  v.object("up", [&](SummaryTree& up) {
    visit(state.up, up);
    up({"levelled"}, state.levelled);
    up({"levelled_deg"}, state.levelled_rad * kDegreesPerRadian);
    up.shown("text", {}, to_string(state.up));
  });
}

/// Corrections of the map while the run went on.
void add_live_corrections(const std::vector<LiveCorrection>& corrections, SummaryTree& v) {
  v.list("live_corrections", corrections);
  if (!corrections.empty()) v.shown("corrections", {}, corrections.size());
  double longest_stall_ms = 0;
  for (const LiveCorrection& live : corrections) longest_stall_ms = std::max(longest_stall_ms, live.stall_ms);
  v({"longest_stall_ms", "longest wait for a correction", "{:.1f} ms"}, longest_stall_ms);
}

/// The finished map and mesh, and how far the mesh is from the true one.
void add_map_and_mesh(const SlamSummary& summary, SummaryTree& v) {
  v({"volumes", "blocks"}, summary.volumes);
  v({"map_bytes", "map", "{:.1f} MB", 1e-6}, summary.map_bytes);
  v({"volumes_refused"}, summary.volumes_refused);
  v.object("mesh", [&](SummaryTree& mesh) {
    mesh({"vertices", "vertices"}, summary.vertices);
    mesh({"triangles", "triangles"}, summary.triangles);
    if (const double size_m = summary.parameters.mesh.min_piece_size_m; size_m > 0)
      mesh({"min_piece_size_m", "smaller pieces are left out", "{:g} cm", 1e2}, size_m);
  });
  add_box(v, "bounds_m", summary.bounds_m);
  const MeshErrorParams& near = summary.parameters.mesh_error;
  if (summary.mesh_error) v.group("mesh_error", MeasuredMesh{*summary.mesh_error, near});
  if (summary.odometry_mesh_error)
    v.group("odometry_mesh_error", MeasuredMesh{*summary.odometry_mesh_error, near});
}

}  // namespace

void visit(const SlamSummary& summary, SummaryTree& v) {
  const SlamPipeline::State& state = summary.state;
  v.group("verdict", summary.verdict);
  v.group("capture", summary.capture);
  v({"method"}, kOdometryMethodNames[static_cast<std::size_t>(summary.parameters.odometry.method)]);
  if (summary.resumed_at_frame)
    v({"resumed_at_frame", "resumed at frame", "{:d}"}, *summary.resumed_at_frame);
  visit(state.track, v);
  v.group("continued", state.continued);
  v.group("loops", state.loops);
  v.group("bundle_adjustment", state.alignment);
  if (summary.error) visit_error(*summary.error, v);
  if (summary.odometry_error)
    v.object("odometry", [&](SummaryTree& odometry) { visit_error(*summary.odometry_error, odometry); });
  v({"largest_correction_m", "largest correction", "{:.3f} m"}, state.largest_shift_m);
  v.group("alignment", state.dense_alignment);
  add_up(state, v);
  v({"frames_mapped", "frames mapped"}, state.frames_mapped);
  v({"frames_disconnected", "frames in unconnected maps"}, state.frames_disconnected);
  v.group("map_correction", state.correction);
  add_live_corrections(state.live_corrections, v);
  v.spread({"frame_ms", "a frame", "{:.1f} ms"}, state.frame_ms, {"median", "mean", "p99", "max"});
  add_map_and_mesh(summary, v);
  v({"interrupted"}, state.interrupted);
  v({"run_s", "time", "{:.1f} s"}, summary.run_s);
}

std::string to_text(const SlamSummary& summary) {
  const SummaryTree tree = describe(summary);
  return tree.lines({"resumed at frame {resumed_at_frame}", "verdict   {verdict.text}"}) +
         capture_lines(tree) + tracking_lines(tree) +
         tree.lines(
             {"continued {continued.from}: recognised after {continued.recognised_at_s}, "
              "{continued.loops|loop} with its {continued.earlier_keyframes|keyframe}",
              "loops     {loops.accepted} of {loops.candidates|candidate} accepted, largest correction "
              "{largest_correction_m}",
              "alignment {alignment.accepted|frame} aligned, {alignment.not_accepted} not; "
              "{alignment.mean_ms} a "
              "frame, 99 % under {alignment.p99_ms}",
              "bundle    {bundle_adjustment.landmarks|landmark}, "
              "{bundle_adjustment.loop_links|match|matches} from "
              "loops, {bundle_adjustment.visit_links} from other visits; reprojection error "
              "{bundle_adjustment.error_before_px} before, {bundle_adjustment.error_after_px} after",
              "odometry  ATE {odometry.ate_rmse_m}[, RPE {odometry.rpe_frame_m} a frame][, "
              "{odometry.rpe_second_m} and {odometry.rpe_second_rad} a second]",
              "corrected ATE {ate_rmse_m}[, RPE {rpe_frame_m} a frame][, {rpe_second_m} and {rpe_second_rad} "
              "a "
              "second]",
              "map       {frames_mapped|frame}, {volumes|block}, {mesh.triangles|triangle}[ (pieces under "
              "{mesh.min_piece_size_m} left out)]; "
              "{map_correction.volumes_rebuilt} of {map_correction.volumes_before|block} rebuilt in "
              "{map_correction.seconds}",
              "          corrected {corrections|time} during tracking, which waited {longest_stall_ms} at "
              "most",
              "up        {up.text}",
              "surface error before loops were closed {odometry_mesh_error.accuracy_mm.mean}",
              "surface error {mesh_error.accuracy_mm.mean} (mean), {mesh_error.completeness_ratio} "
              "complete"}) +
         output_lines(summary.outputs);
}

}  // namespace hm
