#include "hm/pipeline/dense/reconstruction.hpp"

#include <algorithm>
#include <utility>

#include "hm/core/check.hpp"
#include "hm/core/process_memory.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/mapping/map_store.hpp"
#include "hm/mesh/incremental_mesher.hpp"
#include "hm/pipeline/checks/preflight.hpp"
#include "hm/pipeline/checks/recording_findings.hpp"
#include "hm/pipeline/common/frame_range.hpp"
#include "hm/pipeline/common/run_records.hpp"
#include "hm/pipeline/common/scene_level.hpp"
#include "hm/pipeline/common/truth_comparison.hpp"
#include "hm/pipeline/dense/alignment_summary.hpp"
#include "hm/pipeline/dense/reconstruction_output.hpp"
#include "hm/pipeline/dense/reconstruction_state.hpp"
#include "hm/pipeline/live/live_view.hpp"
#include "hm/pipeline/verdict/depth_visits.hpp"

namespace hm {
namespace {

/// One run of reconstruct(): the recording, the pipeline, the map file and how far they are.
class Run {
 public:
  Run(const ReconstructionOptions& options, ResultFolder& folder, std::unique_ptr<Recording> recording,
      Trajectory poses)
      : options_(options),
        folder_(folder),
        recording_(std::move(recording)),
        poses_(std::move(poses)),
        range_(frame_range(options.parameters.reconstruction, recording_->info().frame_count)),
        pipeline_(options.parameters, recording_->info().camera.without_distortion(), options.run.threads) {}

  void add_checks(Preflight&& checks) {
    summary_.warnings = std::move(checks.warnings);
    add_doubts(std::move(checks.doubts), summary_.verdict);
  }
  Result<void> open_map();
  /// Whether the run that is continued was complete, with no frame left in the range of this one.
  [[nodiscard]] bool already_complete() const {
    return folder_.resumed() && folder_.resumed()->state == RunState::kComplete &&
           state_.next_frame >= range_.end;
  }
  /// From here on RunContext::view sees the mesh.
  void show_mesh() {
    if (options_.run.view) pipeline_.observe_mesh(options_.run.view);
  }
  Result<void> integrate_all();
  void summarise();
  Result<ReconstructionSummary> finish();

 private:
  [[nodiscard]] MapHeader header() const;
  void level_poses();
  Result<void> continue_map(const std::filesystem::path& path);
  [[nodiscard]] std::optional<SE3> given_pose(Time stamp) const;
  /// A frame's pose, given and levelled.
  void place(RgbdFrame& frame) const;
  [[nodiscard]] GivenPoses given_poses() const { return {poses_, max_pose_gap()}; }
  [[nodiscard]] Duration max_pose_gap() const {
    return Duration::from_seconds(options_.recording_options.max_pose_gap_s);
  }
  Result<void> check_poses(const std::filesystem::path& map) const;
  Result<void> take(std::size_t index, const Result<RgbdFrame>& frame, FrameRecord& record);
  void note_alignment(const FrameOutcome& outcome, FrameRecord& record);
  void warn_of_memory_cap(const ScanStats& scan, std::size_t index);
  Result<void> save_some();
  Result<void> begin_save();
  Result<void> publish_first_save();
  Result<void> note_up_in_map();
  [[nodiscard]] bool save_is_due() const;
  void note(const FrameRecord& record);
  void show_progress(const FrameRecord& last) const;
  void show_frame(const Result<RgbdFrame>& frame, const FrameOutcome& outcome) const;
  void show_numbers(const FrameRecord& last) const;
  /// Frames of the range that are done.
  [[nodiscard]] std::size_t frames_done() const;

  const ReconstructionOptions& options_;
  ResultFolder& folder_;
  std::unique_ptr<Recording> recording_;
  Trajectory poses_;  ///< instead of the recording's; empty: none
  FrameRange range_;
  DensePipeline pipeline_;
  ReconstructionState state_;
  std::optional<MapSaver> saver_;
  ReconstructionSummary summary_;
  EvenlyThinned<FrameRecord> records_;
  RunningSummary scan_ms_, mesh_ms_, align_ms_;
  std::map<AlignmentStatus, std::size_t> not_accepted_by_status_;
  Stopwatch run_watch_, save_watch_;
  std::size_t frames_since_save_ = 0;
  bool published_ = false;  ///< the map is in its place; before, it is among what is not published
};

MapHeader Run::header() const {
  DenseParameters parameters = options_.parameters;
  MapHeader header;
  header.voxel_size_m = pipeline_.grid().voxel_size_m();
  header.sdf_unit_m = pipeline_.grid().sdf_unit_m();
  header.program_version = options_.run.program_version;
  header.parameters_toml = list_reconstruction(parameters).to_toml();
  return header;
}

Result<void> Run::open_map() {
  const auto path = folder_.path() / "map.hmap";
  state_ = initial_state(recording_->info(), range_.begin);
  std::error_code code;
  if (folder_.resumed() && std::filesystem::exists(path, code)) return continue_map(path);
  if (options_.existing == ExistingResult::kResume && options_.run.log)
    options_.run.log(LogLevel::kInfo,
                     fmt::format("{} does not exist yet: starting at the first frame", path.string()));
  if (options_.parameters.reconstruction.level) level_poses();
  MapHeader first = header();
  first.state_json = state_to_json(state_);
  auto file = as_run_failure(MapFile::create(folder_.staging() / "map.hmap", first));
  if (!file) return forward_error(file);
  saver_.emplace(std::move(*file));
  return {};
}

/// Finds up from depth images all over the recording, coarsely, before anything is integrated.
void Run::level_poses() {
  constexpr std::size_t kMostFrames = 80;
  const std::size_t every = range_.stride * std::max<std::size_t>(1, range_.count() / kMostFrames);
  const UpClues clues{recording_->info().camera.without_distortion(), recording_->info().imu};
  std::vector<SurfacePatch> patches;
  Trajectory path;
  FramePrefetcher frames(*recording_, range_.begin, range_.end, every,
                         {.readers = options_.run.threads, .depth_only = true});
  const std::size_t total = (range_.end - range_.begin + every - 1) / every;
  std::size_t read = 0;
  while (auto frame = frames.next()) {
    if (options_.run.stop.stop_requested()) return;
    if (options_.run.progress) options_.run.progress({"finding up", ++read, total, {}});
    if (!*frame) continue;
    place(**frame);
    const auto& pose = (*frame)->T_world_camera;
    if (!pose || !is_rigid(*pose)) continue;
    path.push_back({(*frame)->stamp, *pose});
    for (const SurfacePatch& patch : patches_of({**frame, *pose}, clues.camera)) patches.push_back(patch);
  }
  const Trajectory& whole = poses_.empty() ? recording_->info().trajectory : poses_;
  const UpDirection up = find_up(patches, clues.imu && whole.size() > path.size() ? whole : path, clues);
  if (up.known()) state_.T_level_given = {rotation_to_z_up(snapped_to_axis(up.up)), Vec3::Zero()};
}

Result<void> Run::continue_map(const std::filesystem::path& path) {
  auto file = MapFile::open(path, MapOpenMode::kReadWrite);
  if (!file) return forward_error(file);
  auto state = state_from_json(file->header().state_json, path.string());
  if (!state) return forward_error(state);
  const auto resumable = check_resumable(file->header(), header(), *state, recording_->info(),
                                         options_.parameters, path.string());
  if (!resumable) return resumable;
  MapLoadOptions load;
  load.max_bytes = pipeline_.grid().max_bytes();
  auto grid = load_grid(*file, load);
  if (!grid) return forward_error(grid);
  saver_.emplace(std::move(*file));
  saver_->restore_marks(*grid, state->interior_marks);
  pipeline_.adopt(std::move(*grid));
  pipeline_.set_T_map_input(state->T_map_input);
  state_ = std::move(*state);
  if (const auto same = check_poses(path); !same) return same;
  published_ = true;
  summary_.resumed = true;
  summary_.resumed_at_frame = state_.next_frame;
  if (options_.run.log)
    options_.run.log(LogLevel::kInfo, fmt::format("continuing at frame {} with {}", state_.next_frame,
                                                  counted(pipeline_.grid().volume_count(), "block")));
  return {};
}

std::optional<SE3> Run::given_pose(Time stamp) const { return pose_at(poses_, stamp, max_pose_gap()); }

void Run::place(RgbdFrame& frame) const {
  if (!poses_.empty()) frame.T_world_camera = given_pose(frame.stamp);
  if (frame.T_world_camera && !state_.T_level_given.rotation().isIdentity(0))
    frame.T_world_camera = state_.T_level_given * *frame.T_world_camera;
}

/// An error when the map was begun with other poses than those given now.
Result<void> Run::check_poses(const std::filesystem::path& map) const {
  if (poses_.empty() || state_.trajectory.empty()) return {};
  const StampedPose& last = state_.trajectory.back();
  const std::optional<SE3> now = given_pose(last.stamp);
  constexpr double kSame = 1e-6;  // metres, radians: text has 9 decimals
  if (now &&
      ((state_.T_map_input * (state_.T_level_given * *now)).inverse() * last.T_world_base).log().norm() <
          kSame)
    return {};
  return fail(ErrorCode::kUsage, map.string(), "this map was begun with other poses than those of {}",
              options_.poses.string());
}

Result<void> Run::integrate_all() {
  FramePrefetcher prefetcher(*recording_, state_.next_frame, std::max(range_.end, state_.next_frame),
                             range_.stride,
                             prefetch_options(options_.parameters.reconstruction, options_.run.threads));
  while (!options_.run.stop.stop_requested()) {
    const Stopwatch wait;
    auto frame = prefetcher.next();
    if (!frame) return {};
    if (*frame) place(**frame);
    FrameRecord record;
    record.wait_ms = wait.milliseconds();
    if (const auto taken = take(state_.next_frame, *frame, record); !taken) return taken;
    state_.next_frame = std::min(state_.next_frame + range_.stride, range_.end);
    ++frames_since_save_;
    const Stopwatch saving;
    if (const auto saved = save_some(); !saved) return saved;
    record.save_ms = saving.milliseconds();
    record.time_s = run_watch_.seconds();
    note(record);
    show_progress(record);
  }
  summary_.interrupted = state_.next_frame < range_.end;
  return {};
}

Result<void> Run::take(std::size_t index, const Result<RgbdFrame>& frame, FrameRecord& record) {
  record.index = index;
  if (!frame) {
    state_.skipped.push_back({index, "unreadable: " + to_string(frame.error())});
    show_frame(frame, {});
  } else {
    ++state_.frames_read;
    const FrameOutcome outcome = pipeline_.process(*frame);
    if (!outcome.scan.out_of_memory.empty())
      return fail(ErrorCode::kOutOfMemory, fmt::format("frame {}", index), "{}", outcome.scan.out_of_memory);
    saver_->note(outcome.scan.changed);
    warn_of_memory_cap(outcome.scan, index);
    if (outcome.integrated) {
      ++state_.frames_integrated;
      state_.trajectory.push_back({frame->stamp, outcome.T_world_camera});
    } else {
      state_.skipped.push_back({index, outcome.skipped_because});
    }
    show_frame(frame, outcome);
    note_alignment(outcome, record);
    record.scan_ms = outcome.scan.total_ms;
    record.allocate_ms = outcome.scan.allocate_ms;
    record.integrate_ms = outcome.scan.integrate_ms;
    record.carve_ms = outcome.scan.carve_ms;
    record.mesh_ms = outcome.mesh_ms;
    record.pack_ms = outcome.pack_ms;
  }
  record.volumes = pipeline_.grid().volume_count();
  record.map_bytes = pipeline_.grid().map_bytes();
  record.mesh_bytes = pipeline_.mesher().bytes();
  record.resident_bytes = resident_bytes();
  return {};
}

void Run::note_alignment(const FrameOutcome& outcome, FrameRecord& record) {
  if (!outcome.alignment) return;
  const AlignmentResult& alignment = *outcome.alignment;
  const bool first = state_.frames_integrated + (outcome.integrated ? 0u : 1u) == 1;  // nothing to align to
  if (!first)
    ++(alignment.status == AlignmentStatus::kAccepted ? state_.frames_aligned : state_.frames_not_aligned);
  const SE3 T_map_input_before = std::exchange(state_.T_map_input, pipeline_.T_map_input());
  record.align_ms = alignment.milliseconds;
  record.alignment = alignment.status;
  record.shift_m =
      (outcome.T_world_camera.translation() -
       T_map_input_before * (state_.T_map_input.inverse() * outcome.T_world_camera.translation()))
          .norm();
  record.rms_before_m = alignment.before.rms_m, record.rms_after_m = alignment.after.rms_m;
}

void Run::warn_of_memory_cap(const ScanStats& scan, std::size_t index) {
  if (scan.volumes_refused > 0 && state_.volumes_refused == 0 && options_.run.log)
    options_.run.log(
        LogLevel::kWarning,
        fmt::format(
            "the map's memory cap of {} MB is reached at frame {}: existing blocks are still updated, no "
            "new ones are added",
            options_.parameters.tsdf.max_map_mb, index));
  state_.volumes_refused += scan.volumes_refused;
}

bool Run::save_is_due() const {
  const ReconstructionParams& params = options_.parameters.reconstruction;
  if (state_.frames_integrated == 0) return false;
  if (params.save_interval_frames > 0 &&
      frames_since_save_ >= static_cast<std::size_t>(params.save_interval_frames))
    return true;
  return params.save_interval_s > 0 && save_watch_.seconds() >= params.save_interval_s;
}

/// Goes on with the save that is under way, or begins one when it is time.
Result<void> Run::save_some() {
  if (!saver_->saving()) return save_is_due() ? begin_save() : Result<void>();
  if (const auto saved = as_run_failure(saver_->continue_save(pipeline_.grid())); !saved) return saved;
  return saver_->saving() || published_ ? Result<void>() : publish_first_save();
}

/// From here on the map in the folder is that of this run.
Result<void> Run::publish_first_save() {
  published_ = true;
  std::vector<std::filesystem::path> files{folder_.staging() / "map.hmap"};
  return as_run_failure(saver_->move_file(folder_.path() / "map.hmap",
                                          [&] { return folder_.publish(files, RunState::kRunning); }));
}

Result<void> Run::begin_save() {
  const auto header_with = [header = header(), state = state_](const std::set<VolumeKey>& marks) mutable {
    state.interior_marks.assign(marks.begin(), marks.end());
    header.state_json = state_to_json(state);
    return header;
  };
  save_watch_.restart();
  frames_since_save_ = 0;
  return as_run_failure(saver_->begin_save(pipeline_.grid(), header_with));
}

/// Keeps what the report needs of a frame.
void Run::note(const FrameRecord& record) {
  scan_ms_.add(record.scan_ms);
  mesh_ms_.add(record.mesh_ms);
  if (record.alignment) align_ms_.add(record.align_ms);
  if (record.alignment && *record.alignment != AlignmentStatus::kAccepted)
    ++not_accepted_by_status_[*record.alignment];
  records_.push_back(record);
}

std::size_t Run::frames_done() const {
  const std::size_t left = state_.next_frame < range_.end
                               ? (range_.end - state_.next_frame + range_.stride - 1) / range_.stride
                               : 0;
  return range_.count() - std::min(left, range_.count());
}

void Run::show_progress(const FrameRecord& last) const {
  if (options_.run.view) show_numbers(last);
  if (!options_.run.progress) return;
  options_.run.progress({"reconstructing", frames_done(), range_.count(),
                         fmt::format("{}, map {} MB, process {} MB", counted(last.volumes, "block"),
                                     last.map_bytes / 1'000'000, last.resident_bytes / 1'000'000)});
}

void Run::show_frame(const Result<RgbdFrame>& frame, const FrameOutcome& outcome) const {
  if (!options_.run.view) return;
  const auto T_map_camera = outcome.integrated ? std::optional(outcome.T_world_camera) : std::nullopt;
  options_.run.view->on_camera({frame ? frame->stamp : Time{}, frame ? &*frame : nullptr,
                                recording_->camera(), T_map_camera,
                                frame ? outcome.skipped_because : to_string(frame.error())});
}

void Run::show_numbers(const FrameRecord& last) const {
  LiveNumbers numbers{"reconstructing", frames_done(), range_.count(), {}, {}, {}};
  numbers.stages_ms = {{"waiting", last.wait_ms},      {"align", last.align_ms},
                       {"allocate", last.allocate_ms}, {"integrate", last.integrate_ms},
                       {"carve", last.carve_ms},       {"mesh", last.mesh_ms},
                       {"pack", last.pack_ms},         {"save", last.save_ms}};
  numbers.counts = {{"frames integrated", state_.frames_integrated},
                    {"frames skipped", state_.skipped.size()},
                    {"blocks", last.volumes}};
  numbers.memory = {{"process", last.resident_bytes}, {"map", last.map_bytes}, {"mesh", last.mesh_bytes}};
  options_.run.view->on_numbers(numbers);
}

/// The mesh has told where up is, when the map was complete already.
Result<void> Run::note_up_in_map() {
  auto map = MapFile::open(folder_.path() / "map.hmap", MapOpenMode::kReadWrite);
  if (!map) return forward_error(map);
  MapHeader with_up = map->header();
  auto state = state_from_json(with_up.state_json, folder_.path().string());
  if (!state) return forward_error(state);
  state->up = summary_.up;
  with_up.state_json = state_to_json(*state);
  return as_run_failure(map->commit(with_up));
}

/// Puts into the summary what was integrated, and how long it took.
void Run::summarise() {
  summary_.run_s = run_watch_.seconds();
  summary_.recording = recording_->info();
  summary_.pose_source =
      options_.poses.empty() ? pose_source(summary_.recording) : std::filesystem::absolute(options_.poses);
  summary_.parameters = options_.parameters;
  summary_.threads = options_.run.threads;
  summary_.frames_total = range_.count();
  summary_.frames_read = state_.frames_read;
  summary_.frames_integrated = state_.frames_integrated;
  summary_.skipped = state_.skipped;
  summary_.trajectory = state_.trajectory;
  summary_.T_level_given = state_.T_level_given;
  summary_.levelled = options_.parameters.reconstruction.level;
  summary_.frames_this_run = records_.count();
  summary_.records = records_.take();
  summary_.integrate_ms = scan_ms_.summary();
  summary_.mesh_ms = mesh_ms_.summary();
  if (summary_.run_s > 0)
    summary_.frames_per_s = static_cast<double>(summary_.frames_this_run) / summary_.run_s;
  if (options_.parameters.reconstruction.align) {
    summary_.alignment = summarise_alignment(state_, given_poses(), recording_->info(), options_.parameters);
    for (StampedPose& pose : summary_.alignment->given)
      pose.T_world_base = state_.T_level_given * pose.T_world_base;
    summary_.alignment->ms = align_ms_.summary();
    summary_.alignment->not_accepted_by_status = std::move(not_accepted_by_status_);
  }
  summary_.volumes = pipeline_.grid().volume_count();
  summary_.volumes_refused = state_.volumes_refused;
  summary_.map_bytes = pipeline_.grid().map_bytes();
  summary_.map_file_bytes = saver_->file().file_bytes();
}

Result<ReconstructionSummary> Run::finish() {
  if (state_.frames_integrated == 0 && summary_.interrupted)
    return fail(ErrorCode::kCancelled, {}, "stopped before the first frame was integrated");
  if (state_.frames_integrated == 0)
    return fail(ErrorCode::kInvalidValue, options_.recording.string(),
                "not one of {} could be integrated ({}); `hm info` may show why",
                counted(range_.count(), "frame"), commonest_reason(state_.skipped));
  auto saved = begin_save();
  if (saved) saved = as_run_failure(saver_->finish_save(pipeline_.grid()));
  if (!saved) return forward_error(saved);
  summarise();
  judge_depth_visits(*recording_, summary_.trajectory, options_.run, summary_.verdict);
  const auto without_pose = std::ranges::count(state_.skipped, kNoPose, &SkippedFrame::reason);
  judge_missing_poses(static_cast<std::size_t>(without_pose),
                      state_.frames_integrated + state_.skipped.size(), "frames", summary_.verdict);
  judge_memory_limit(
      {"tsdf.max_map_mb", options_.parameters.tsdf.max_map_mb, state_.volumes_refused, "block"},
      summary_.warnings, summary_.verdict);
  if (options_.run.view) options_.run.view->on_end(summary_.verdict);
  saver_.reset();
  std::vector<std::filesystem::path> map{folder_.staging() / "map.hmap"};
  if (const auto published = folder_.publish(map, RunState::kRunning); !published)
    return forward_error(published);
  const auto written = write_results(pipeline_, options_, folder_.staging(), summary_);
  if (!written) return forward_error(written);
  if (const auto noted = note_up_in_map(); !noted) return forward_error(noted);
  const auto published =
      folder_.publish(summary_.outputs, summary_.interrupted ? RunState::kStopped : RunState::kComplete);
  if (!published) return forward_error(published);
  return std::move(summary_);
}

/// Why no frame of a recording has a pose.
std::string why_no_pose(const RecordingInfo& info) {
  if (!info.trajectory.empty()) return why_no_pose_fits(info);
  if (info.poses_unreadable.empty()) return "this recording has no poses of its camera";
  return "its poses cannot be used: " + info.poses_unreadable;
}

}  // namespace

Result<ReconstructionSummary> reconstruct(const ReconstructionOptions& options) {
  if (const auto checked = check_parameters(options.parameters); !checked) return forward_error(checked);
  auto folder = ResultFolder::open(
      {options.output, options.existing, "reconstruct", options.recording, options.run.program_version});
  if (!folder) return forward_error(folder);
  auto recording = open_recording(options.recording, options.recording_options);
  if (!recording) return forward_error(recording);
  Trajectory poses;
  if (!options.poses.empty()) {
    auto read = read_trajectory_of(options.poses, (*recording)->info().stamps);
    if (!read) return forward_error(read);
    poses = std::move(*read);
  } else if (const RecordingInfo& info = (*recording)->info(); info.posed_count == 0) {
    return fail(ErrorCode::kInvalidValue, options.recording.string(),
                "{}; `hm slam` finds them, or give them with --poses", why_no_pose(info));
  }
  auto checks = check_before_run(*recording, {PoseUse::kBuildsOn, poses.empty() ? nullptr : &poses,
                                              options.recording_options.max_pose_gap_s, options.force,
                                              options.parameters.reconstruction.register_color});
  if (!checks) return forward_error(checks);
  Run run(options, *folder, std::move(*recording), std::move(poses));
  run.add_checks(std::move(*checks));
  if (const auto opened = run.open_map(); !opened) return forward_error(opened);
  if (run.already_complete()) {
    ReconstructionSummary complete;
    complete.already_complete = true;
    return complete;
  }
  run.show_mesh();
  if (const auto done = run.integrate_all(); !done) return forward_error(done);
  return run.finish();
}

}  // namespace hm
