#include "hm/pipeline/rgbd/slam_run.hpp"

#include <memory>
#include <utility>

#include "hm/core/stopwatch.hpp"
#include "hm/pipeline/checks/preflight.hpp"
#include "hm/pipeline/rgbd/slam_finish.hpp"
#include "hm/pipeline/rgbd/slam_save.hpp"

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
  summary.warnings = std::move(*warnings);
  const auto finished = finish_slam({pipeline, **recording, folder->staging(), options, watch}, summary);
  if (!finished) return forward_error(finished);
  const auto state_files = (*save)->finish(*summary.state.keyframes);
  if (!state_files) return forward_error(state_files);
  summary.outputs.insert(summary.outputs.end(), state_files->begin(), state_files->end());
  const auto published =
      folder->publish(summary.outputs, summary.state.interrupted ? RunState::kStopped : RunState::kComplete);
  if (!published) return forward_error(published);
  return summary;
}

}  // namespace hm
