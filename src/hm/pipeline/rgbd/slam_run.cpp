#include "hm/pipeline/rgbd/slam_run.hpp"

#include <memory>
#include <utility>

#include "hm/core/stopwatch.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/pipeline/checks/preflight.hpp"
#include "hm/pipeline/common/mesh_evaluation.hpp"
#include "hm/pipeline/common/truth_comparison.hpp"
#include "hm/pipeline/live/live_view.hpp"
#include "hm/pipeline/rgbd/odometry_run.hpp"
#include "hm/pipeline/rgbd/slam_output.hpp"
#include "hm/pipeline/rgbd/slam_save.hpp"
#include "hm/pipeline/rgbd/tracking_view.hpp"
#include "hm/pipeline/verdict/depth_visits.hpp"

namespace hm {
namespace {

Error nothing_tracked(const SlamRunOptions& options, const SlamPipeline::State& state,
                      const std::vector<std::string>& warnings) {
  if (state.interrupted) return {ErrorCode::kCancelled, "stopped before the first frame had a pose", {}};
  return {ErrorCode::kInvalidValue, why_no_pose(state.track, warnings), options.recording.string()};
}

void compare_trajectories(SlamSummary& summary) {
  const TrajectoryErrorParams& params = summary.parameters.trajectory_error;
  std::vector<std::string> said;
  summary.odometry_error =
      compare_with_truth(summary.state.track.trajectory, summary.recording, params, summary.warnings);
  summary.error = compare_with_truth(summary.state.corrected, summary.recording, params, said);
}

void add_warnings(const SlamRunOptions& options, SlamSummary& summary) {
  const SlamPipeline::State& state = summary.state;
  for (std::string& warning : warnings_of(state.track)) summary.warnings.push_back(std::move(warning));
  if (state.frames_disconnected > 0)
    summary.warnings.push_back(
        fmt::format("{} not in the map: no closed loop connects that part of the trajectory with its start",
                    counted(state.frames_disconnected, "frame")));
  if (state.correction.frames_lost > 0)
    summary.warnings.push_back(fmt::format("{} could not be read again when the map was rebuilt",
                                           counted(state.correction.frames_lost, "frame")));
  if (!state.alignment.failure.empty())
    summary.warnings.push_back(fmt::format("bundle adjustment failed ({}): poses are those of the pose graph",
                                           state.alignment.failure));
  if (state.alignment.observations_behind > 0)
    summary.warnings.push_back(
        fmt::format("bundle adjustment left out {} of landmarks behind the camera and used {}",
                    counted(state.alignment.observations_behind, "observation"),
                    with_thousands(state.alignment.observations)));
  if (state.alignment.interrupted)
    summary.warnings.emplace_back(
        "bundle adjustment was stopped: poses are less accurate than they could be");
  if (state.track.frames_read < state.frames_total && state.interrupted)
    summary.warnings.push_back(fmt::format("stopped after {} of {}", with_thousands(state.track.frames_read),
                                           counted(state.frames_total, "frame")));
  if (!state.up.known())
    summary.warnings.emplace_back(
        "up is unknown: there is no accelerometer, and floor and walls do not determine it; the map's z axis "
        "is "
        "the upward direction of the first image");
  if (options.parameters.loops.enabled && state.loops.accepted == 0 && state.track.keyframes.size() > 20)
    summary.warnings.emplace_back(
        "no place was recognised again, so no loop was closed: the trajectory is that of odometry");
}

void judge_slam(const Recording& recording, const SlamRunOptions& options, SlamSummary& summary) {
  const SlamPipeline::State& state = summary.state;
  judge_depth_visits(recording, state.corrected, options.run, summary.verdict);
  judge_tracking(state.track, summary.verdict);
  if (state.frames_disconnected > 0)
    summary.verdict.add(
        MapVerdict::kDoubtful,
        fmt::format("{} not in the map: nothing joins that part of the trajectory with its start",
                    counted(state.frames_disconnected, "frame")));
}

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

/// What a run is before its first frame: its saves, and where it continues.
Result<std::unique_ptr<SlamSave>> begin_saves(SlamPipeline& pipeline, ResultFolder& folder,
                                              const Recording& recording, const SlamRunOptions& options,
                                              SlamSummary& summary) {
  auto saved = saved_run(folder, recording, options);
  if (!saved) return forward_error(saved);
  SlamSaveState state = initial_save_state(recording.info(), options.run.program_version);
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
  auto warnings = check_before_run(**recording, {.poses = PoseUse::kComparesWith, .force = options.force});
  if (!warnings) return forward_error(warnings);
  const Stopwatch watch;
  SlamPipeline pipeline(**recording, options.parameters, options.run);
  SlamSummary summary;
  const auto save = begin_saves(pipeline, *folder, **recording, options, summary);
  if (!save) return forward_error(save);
  if (const auto tracked = track_and_save(pipeline, **save); !tracked) return forward_error(tracked);
  pipeline.close_loops();
  if (pipeline.state().track.trajectory.empty())
    return tl::make_unexpected(nothing_tracked(options, pipeline.state(), *warnings));
  pipeline.level();
  TriangleMesh before;
  const bool compare = has_mesh_truth(options.recording) || options.parameters.reconstruction.pictures;
  if (compare && pipeline.state().loops.accepted > 0) before = pipeline.mesh_of_odometry();
  if (const auto corrected = pipeline.correct_dense_map(); !corrected) return forward_error(corrected);
  summary.warnings = std::move(*warnings);
  summary.recording = (*recording)->info();
  summary.parameters = options.parameters;
  summary.state = std::move(pipeline.state());
  summary.run_s = watch.seconds();
  compare_trajectories(summary);
  add_warnings(options, summary);
  judge_slam(**recording, options, summary);
  show_corrected(options.run, summary.state.corrected, *summary.state.keyframes);
  if (options.run.view) options.run.view->on_end(summary.verdict);
  SlamRunOptions staged = options;
  staged.output = folder->staging();
  if (const auto written = write_slam_results(pipeline, **recording, before, staged, summary); !written)
    return tl::make_unexpected(as_run_failure(Result<void>(written)).error());
  const auto state_files = (*save)->finish(*summary.state.keyframes);
  if (!state_files) return forward_error(state_files);
  summary.outputs.insert(summary.outputs.end(), state_files->begin(), state_files->end());
  const auto published =
      folder->publish(summary.outputs, summary.state.interrupted ? RunState::kStopped : RunState::kComplete);
  if (!published) return forward_error(published);
  return summary;
}

}  // namespace hm
