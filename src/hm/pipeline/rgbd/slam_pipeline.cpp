#include "hm/pipeline/rgbd/slam_pipeline.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>
#include <thread>
#include <utility>

#include "hm/core/angle.hpp"
#include "hm/core/check.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/io/rgbd/frame_archive.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/mapping/keyframes/keyframe_depths.hpp"
#include "hm/pipeline/common/frame_range.hpp"
#include "hm/pipeline/common/parameters.hpp"
#include "hm/pipeline/common/run_records.hpp"
#include "hm/pipeline/common/scene_level.hpp"
#include "hm/pipeline/common/sensor_prior.hpp"
#include "hm/pipeline/common/truth_comparison.hpp"
#include "hm/pipeline/live/live_view.hpp"
#include "hm/pipeline/rgbd/odometry_run.hpp"
#include "hm/pipeline/rgbd/resume/earlier_map.hpp"
#include "hm/pipeline/rgbd/resume/slam_checkpoint.hpp"
#include "hm/pipeline/rgbd/rgbd_parameter_list.hpp"
#include "hm/pipeline/rgbd/slam_state.hpp"
#include "hm/pipeline/rgbd/tracking_view.hpp"
#include "hm/slam/rgbd/live_rgbd_loop_closer.hpp"

namespace hm {
namespace {

VisualTracking::Start start_of(const Recording& recording, const FrameRange& range,
                               const std::optional<SE3>& T_map_first_camera) {
  return {range.count(), T_map_first_camera.value_or(level_camera()), recording.info().imu,
          is_from_kinect(recording.info())};
}

}  // namespace

struct SlamPipeline::Impl {
  Impl(const FrameSource& frames, const VisualTracking::Start& start, const RgbdParameters& all,
       const RunContext& its_run)
      : parameters(all),
        run(its_run),
        camera(frames.camera()),
        tracking(all.odometry, camera, start),
        closer(camera, all.loops, its_run.background),
        map(all, frames, its_run),
        source(frames),
        clues{camera, nullptr} {
    if (all.slam.align) alignment.emplace(all, camera);
    if (run.view) map.dense().observe_mesh(run.view);
  }

  struct Taken {
    TrackedFrame tracked;
    std::optional<SE3> T_map_camera;
  };
  Taken take(std::size_t index, Result<RgbdFrame>& frame, double wait_ms, const SlamHooks& hooks = {});
  void align(const RgbdFrame& frame, TrackedFrame& tracked);
  void begin_in(const EarlierMap& saved);
  void join_sessions(TrackedFrame& tracked) const;
  void close_earlier_loops(std::span<const std::shared_ptr<const Keyframe>> keyframes);
  void keep(const RgbdFrame& frame);
  [[nodiscard]] bool is_for_map() const;
  void show_progress() const;
  void show(const RgbdFrame* frame, const std::optional<SE3>& T_map_camera);
  [[nodiscard]] Trajectory trajectory_now() const;
  void begin_level(const RgbdFrame& first);
  [[nodiscard]] std::vector<SurfacePatch> seen_patches() const;
  void conclude_tracking();
  void place_trajectory();

  std::unique_ptr<FrameSource> sessions;  ///< with an earlier map
  const EarlierMap* earlier = nullptr;
  std::unique_ptr<FrameArchive> archive;  ///< of the map's frames, where nobody else keeps them
  const Recording* recording = nullptr;   ///< where the frames come from; null: add()
  RgbdParameters parameters;
  RunContext run;
  PinholeCamera camera;
  FrameRange range;
  VisualTracking tracking;
  LiveRgbdLoopCloser closer;
  SlamMap map;
  const FrameSource& source;
  UpClues clues;
  bool chooses_frame = false;  ///< nothing gives the map's frame: it is to be level
  std::optional<SlamAlignment> alignment;
  Trajectory aligned;  ///< instead of the tracking's, with alignment; and its keyframes
  std::vector<std::shared_ptr<const Keyframe>> aligned_keyframes;
  RunningSummary frame_ms;
  std::size_t frames_added = 0, frames_not_kept = 0;
  bool finished = false;
  std::size_t first_frame = 0;      ///< of the recording, for track_and_map()
  TrackedRecord last;               ///< frame of track_and_map()
  std::size_t solutions_shown = 0;  ///< of the loops, to run.view
  State state;
};

SlamPipeline::SlamPipeline(const Recording& recording, const RgbdParameters& parameters,
                           const RunContext& run, const EarlierMap* earlier) {
  const FrameRange range = frame_range(parameters.reconstruction, recording.info().frame_count);
  const bool at_pose = parameters.slam.start_at_pose && !earlier;
  const auto first = at_pose ? first_true_pose(recording.info(), range.begin) : std::nullopt;
  std::unique_ptr<FrameSource> sessions;
  if (earlier) sessions = std::make_unique<FramesOfSessions>(recording, *earlier);
  const FrameSource& frames = sessions ? *sessions : static_cast<const FrameSource&>(recording);
  impl_ = std::make_unique<Impl>(frames, start_of(recording, range, first), parameters, run);
  impl_->sessions = std::move(sessions);
  impl_->clues.imu = recording.info().imu;
  impl_->chooses_frame = parameters.slam.level && !first && !earlier;
  impl_->recording = &recording;
  impl_->range = range;
  impl_->first_frame = range.begin;
  if (earlier) impl_->begin_in(*earlier);
}
SlamPipeline::SlamPipeline(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SlamPipeline::SlamPipeline(SlamPipeline&&) noexcept = default;
SlamPipeline::~SlamPipeline() = default;

Result<SlamPipeline> SlamPipeline::create(const SlamInput& input, const std::vector<std::string>& settings,
                                          const RunContext& run) {
  RgbdParameters parameters;
  if (const auto set = apply_settings(list_slam(parameters), settings); !set) return forward_error(set);
  if (const auto checked = check_parameters(parameters); !checked) return forward_error(checked);
  return create(input, parameters, run);
}

SlamPipeline SlamPipeline::create(const SlamInput& input, const RgbdParameters& parameters,
                                  const RunContext& run) {
  HM_CHECK(input.camera.distortion.is_zero(), "the camera has lens distortion");
  std::unique_ptr<FrameArchive> archive;
  if (!input.frames) archive = std::make_unique<FrameArchive>(input.camera, input.max_kept_bytes);
  const FrameSource& frames = archive ? *archive : *input.frames;
  const VisualTracking::Start start{0, input.T_map_first_camera.value_or(level_camera()), nullptr,
                                    input.is_from_kinect};
  auto impl = std::make_unique<Impl>(frames, start, parameters, run);
  impl->archive = std::move(archive);
  impl->chooses_frame = parameters.slam.level && !input.T_map_first_camera;
  return SlamPipeline(std::move(impl));
}

const SlamPipeline::State& SlamPipeline::state() const { return impl_->state; }
SlamPipeline::State& SlamPipeline::state() { return impl_->state; }
void SlamPipeline::set_threads(int threads) { impl_->map.set_threads(impl_->run.threads = threads); }
DensePipeline& SlamPipeline::dense() { return impl_->map.dense(); }
TriangleMesh SlamPipeline::mesh() { return impl_->map.dense().finished_mesh(); }
const Trajectory& SlamPipeline::trajectory() const {
  return impl_->finished ? impl_->state.corrected : impl_->tracking.track().trajectory;
}

/// Until a frame has a pose, each may be the first.
void SlamPipeline::Impl::begin_level(const RgbdFrame& first) {
  const bool right_size = first.depth.width() == camera.width && first.depth.height() == camera.height;
  if (chooses_frame && tracking.track().frames_tracked == 0 && right_size)
    tracking.set_first_camera(level_start(first, clues));
}

/// From here on odometry is what alignment made of it.
void SlamPipeline::Impl::align(const RgbdFrame& frame, TrackedFrame& tracked) {
  if (!alignment || !tracked.T_odom_camera) return;
  alignment->align(frame, tracked);
  aligned.push_back({frame.stamp, *tracked.T_odom_camera});
  if (tracked.new_keyframe) aligned_keyframes.push_back(tracked.new_keyframe);
}

/// True when the last frame, which has a pose, is one for the map.
bool SlamPipeline::Impl::is_for_map() const {
  return (tracking.track().frames_tracked - 1) % static_cast<std::size_t>(parameters.slam.map_stride) == 0;
}

/// Keeps a frame for when a loop has moved it, where nobody else does.
void SlamPipeline::Impl::keep(const RgbdFrame& frame) {
  if (!archive) return;
  const auto kept = archive->keep(frame);
  if (kept) return;
  if (frames_not_kept++ == 0 && run.log)
    run.log(LogLevel::kWarning, to_string(kept.error()) +
                                    "; such frames leave the map when a loop moves it: "
                                    "raise max_kept_bytes or slam.map_stride, or give SlamInput::frames");
}

SlamPipeline::Impl::Taken SlamPipeline::Impl::take(std::size_t index, Result<RgbdFrame>& frame,
                                                   double wait_ms, const SlamHooks& hooks) {
  const Stopwatch watch;
  if (frame) begin_level(*frame);
  Taken taken{tracking.take(index, frame, wait_ms, alignment ? OnPose{} : hooks.on_pose), {}};
  TrackedFrame& tracked = taken.tracked;
  if (frame) align(*frame, tracked);
  if (earlier) join_sessions(tracked);
  if (tracked.new_keyframe && parameters.loops.enabled) {
    closer.add(tracked.new_keyframe);
    state.graph_keyframes.push_back(tracked.new_keyframe);
  }
  bool is_mapped = false;
  if (!frame) show(nullptr, {});
  if (frame) {
    const auto now = closer.snapshot();
    frame->index = index;
    map.follow(now, *frame);
    if (tracked.T_odom_camera) taken.T_map_camera = pose_in_map(now, tracked);
    show(&*frame, taken.T_map_camera);
    if (tracked.T_odom_camera && is_for_map() && !(hooks.is_late && hooks.is_late())) {
      keep(*frame);
      is_mapped = map.add(*frame, tracked);
    }
    frame_ms.add(watch.milliseconds());
  }
  last = tracking.last();
  last.is_mapped = is_mapped;
  last.frame_ms = watch.milliseconds();
  show_progress();
  return taken;
}

SlamStep SlamPipeline::add(RgbdFrame frame, const SlamHooks& hooks) {
  Impl& impl = *impl_;
  HM_CHECK(!impl.recording, "this pipeline takes its frames from a recording");
  HM_CHECK(!impl.finished, "this pipeline is finished");
  const std::size_t index = impl.frames_added++;
  frame.index = index;
  Result<RgbdFrame> given(std::move(frame));
  const Impl::Taken taken = impl.take(index, given, 0, hooks);
  return {taken.tracked.status,
          taken.tracked.reason,
          taken.tracked.T_odom_camera,
          taken.T_map_camera,
          taken.tracked.new_keyframe != nullptr,
          impl.last.is_mapped,
          impl.map.out_of_memory()};
}

Result<void> SlamPipeline::finish() {
  if (impl_->finished) return {};
  close_loops();
  level();
  return correct_dense_map();
}

SlamCounts SlamPipeline::counts() const {
  const Impl& impl = *impl_;
  const VisualTrack& track = impl.finished ? impl.state.track : impl.tracking.track();
  SlamCounts counts;
  counts.frames = track.frames_read + track.unused.size();
  counts.frames_tracked = track.frames_tracked;
  counts.frames_lost = track.frames_lost;
  counts.keyframes = track.keyframes.size();
  counts.loops = impl.closer.snapshot().statistics.accepted;
  counts.frames_not_kept = impl.frames_not_kept;
  counts.kept_bytes = impl.archive ? impl.archive->bytes() : 0;
  return counts;
}

void SlamPipeline::Impl::show_progress() const {
  if (!run.progress) return;
  const VisualTrack& track = tracking.track();
  const auto loops = closer.snapshot();
  run.progress({"tracking", track.frames_read + track.unused.size(), track.frames_total,
                fmt::format("{}, {}, {} lost, {}", counted(track.keyframes.size(), "keyframe"),
                            counted(loops.statistics.accepted, "loop"), track.frames_lost, map.progress())});
}

Result<void> SlamPipeline::track_and_map(const AfterFrame& after_frame) {
  Impl& impl = *impl_;
  const Stopwatch watch;
  HM_CHECK(impl.recording, "this pipeline takes its frames from add()");
  FramePrefetcher frames(*impl.recording, impl.first_frame, impl.range.end, impl.range.stride,
                         prefetch_options(impl.parameters.reconstruction, impl.run.threads));
  std::size_t index = impl.first_frame;
  while (!impl.run.stop.stop_requested()) {
    const Stopwatch wait;
    auto frame = frames.next();
    if (!frame) break;
    impl.take(index, *frame, wait.milliseconds());
    if (const std::string& why = impl.map.out_of_memory(); !why.empty())
      return fail(ErrorCode::kOutOfMemory, fmt::format("frame {}", index), "{}", why);
    index += impl.range.stride;
    if (after_frame)
      if (const auto done = after_frame(index); !done) return done;
  }
  impl.state.frames_total = impl.range.count();
  impl.state.frames_done = std::min(index, impl.range.end);
  impl.state.interrupted = index < impl.range.end;
  impl.state.seconds = watch.seconds();
  return {};
}

bool SlamPipeline::can_be_saved() const {
  StateWriter ignored;
  return !impl_->alignment && impl_->recording && impl_->tracking.save(ignored);
}

const TrackedRecord& SlamPipeline::last_frame() const { return impl_->last; }
bool SlamPipeline::map_is_complete() const { return impl_->map.is_complete(); }

SlamCheckpoint SlamPipeline::checkpoint(std::size_t next_frame) const {
  const Impl& impl = *impl_;
  HM_CHECK(!impl.finished, "the run has ended");
  RgbdParameters parameters = impl.parameters;
  SlamCheckpoint checkpoint;
  checkpoint.camera = impl.camera;
  checkpoint.parameters_toml = list_slam(parameters).to_toml();
  checkpoint.next_frame = next_frame;
  checkpoint.places = keyframe_places(*impl.closer.snapshot().corrected);
  StateWriter odometry;
  impl.tracking.save(odometry);
  checkpoint.odometry = odometry.take();
  return checkpoint;
}

Result<void> SlamPipeline::resume(const SavedSlam& saved) {
  Impl& impl = *impl_;
  HM_CHECK(impl.recording && impl.tracking.track().frames_read == 0, "frames have been tracked");
  std::vector<std::shared_ptr<const Keyframe>> keyframes;
  for (const TrackedRecord& record : saved.records) {
    if (record.keyframe) keyframes.push_back(record.keyframe);
    if (record.was_read) impl.frame_ms.add(record.frame_ms);
  }
  StateReader reader(saved.checkpoint.odometry);
  const auto read_frame = [&impl](std::size_t index) { return impl.source.read(index); };
  if (const auto restored = impl.tracking.restore(reader, saved.records, {read_frame, keyframes}); !restored)
    return restored;
  if (reader.remaining() > 0)
    return fail(ErrorCode::kCorrupted, "state of odometry", "is longer than it should be");
  impl.map.restore(mapped_frames(saved.records));
  impl.first_frame = saved.checkpoint.next_frame;
  if (impl.parameters.loops.enabled) impl.close_earlier_loops(keyframes);
  return {};
}

/// The same keyframes in the same order: the same loops. Waits, so that new frames come into the right map.
void SlamPipeline::Impl::close_earlier_loops(std::span<const std::shared_ptr<const Keyframe>> keyframes) {
  constexpr std::chrono::milliseconds kPoll{5};
  for (const auto& keyframe : keyframes) closer.add(keyframe);
  state.graph_keyframes.assign(keyframes.begin(), keyframes.end());
  for (std::size_t waiting = keyframes.size(); waiting > 0 && !run.stop.stop_requested();) {
    std::this_thread::sleep_for(kPoll);
    waiting = closer.snapshot().waiting_keyframes;
    if (run.progress)
      run.progress({"closing the loops so far again", keyframes.size() - waiting, keyframes.size(), {}});
  }
}

/// The new frames are a map of their own until a loop joins them with the saved one.
void SlamPipeline::Impl::begin_in(const EarlierMap& saved) {
  earlier = &saved;
  map.restore(saved.mapped_frames());
  close_earlier_loops(saved.keyframes());
}

void SlamPipeline::Impl::join_sessions(TrackedFrame& tracked) const {
  tracked.submap += earlier->of_new.submaps;
  if (tracked.new_keyframe) tracked.new_keyframe = shifted(*tracked.new_keyframe, earlier->of_new);
}

/// To whom watches: the frame, and after a loop the path.
void SlamPipeline::Impl::show(const RgbdFrame* frame, const std::optional<SE3>& T_map_camera) {
  if (!run.view) return;
  show_tracked(run, tracking, camera, frame, T_map_camera);
  const auto now = closer.snapshot();
  if (now.solutions == solutions_shown) return;
  solutions_shown = now.solutions;
  show_corrected(run, trajectory_now(), *now.corrected);
}

Trajectory SlamPipeline::trajectory_now() const { return impl_->trajectory_now(); }

Trajectory SlamPipeline::Impl::trajectory_now() const {
  const auto corrected = closer.snapshot().corrected;
  Trajectory now;
  for (const StampedPose& pose : alignment ? aligned : tracking.track().trajectory)
    if (corrected->map_at(pose.stamp) == 0)
      now.push_back(
          {pose.stamp, corrected->T_map_camera(pose.stamp, pose.T_world_base).value_or(pose.T_world_base)});
  return now;
}

void SlamPipeline::Impl::conclude_tracking() {
  if (!recording) state.frames_total = state.frames_done = frames_added;
  state.frame_ms = frame_ms.summary();
  state.live_corrections = map.corrections();
}

/// Brings odometry's poses into the map.
void SlamPipeline::Impl::place_trajectory() {
  const CorrectedKeyframes& corrected = *state.keyframes;
  state.corrected.clear();
  for (const StampedPose& pose : state.track.trajectory) {
    if (corrected.map_at(pose.stamp) != 0) {
      ++state.frames_disconnected;
      continue;
    }
    const auto placed = corrected.T_map_camera(pose.stamp, pose.T_world_base);
    state.corrected.push_back({pose.stamp, placed ? *placed : pose.T_world_base});
  }
  if (earlier) begin_odometry_in_map(state);
  state.largest_shift_m = largest_shift_m(state);
}

void SlamPipeline::close_loops() {
  Impl& impl = *impl_;
  const Stopwatch watch;
  if (impl.run.progress) impl.run.progress({"closing loops", 0, 0, {}});
  impl.conclude_tracking();
  const VisualTrack& track = impl.tracking.track();
  const Trajectory& path = impl.alignment ? impl.aligned : track.trajectory;
  impl.state.alignment = impl.closer.finish(
      impl.run, keyframe_depths(impl.source, path, track.color_delay_s, impl.parameters.depth_noise));
  impl.state.interrupted |= impl.state.alignment.was_stopped();
  const auto snapshot = impl.closer.snapshot();
  impl.state.keyframes = snapshot.corrected;
  impl.state.loops = snapshot.statistics;
  impl.state.graph = impl.closer.graph();
  if (impl.earlier)
    impl.state.continued =
        continued_map(impl.state, *impl.earlier, impl.parameters.loops.verifier.min_inliers);
  impl.state.track = impl.tracking.finish();
  if (!impl.recording) impl.state.track.frames_total = impl.frames_added;
  if (impl.alignment) {
    impl.state.track.trajectory = std::move(impl.aligned);
    impl.state.track.keyframes = std::move(impl.aligned_keyframes);
    impl.state.dense_alignment = impl.alignment->summary();
  }
  impl.place_trajectory();
  impl.finished = true;
  impl.state.close_seconds = watch.seconds();
}

/// Surfaces seen by frames all over the path, at their final poses: the map itself is not there yet, and how
/// far it has come depends on the pace of its threads.
std::vector<SurfacePatch> SlamPipeline::Impl::seen_patches() const {
  constexpr std::size_t kMostFrames = 120;
  std::vector<Observation> observations = map.observations();
  std::erase_if(observations, [&](const Observation& o) { return state.keyframes->map_at(o.stamp) != 0; });
  observations = thinned(std::move(observations), kMostFrames);
  std::vector<std::size_t> indices;
  for (const Observation& observation : observations) indices.push_back(observation.frame_index);
  FramePrefetcher frames(source, std::move(indices), {.readers = run.threads, .depth_only = true});
  std::vector<SurfacePatch> patches;
  for (const Observation& observation : observations) {
    const auto frame = frames.next();
    if (!frame || !*frame) continue;
    const auto placed = state.keyframes->T_map_camera(observation.stamp, observation.T_odom_camera);
    for (const SurfacePatch& patch :
         patches_of({**frame, placed.value_or(observation.T_odom_camera)}, clues.camera))
      patches.push_back(patch);
  }
  return patches;
}

void SlamPipeline::level() {
  constexpr double kLeast_rad = 0.2 * kRadiansPerDegree;  // less is not worth making the map again
  Impl& impl = *impl_;
  if (impl.state.corrected.empty()) return;
  if (impl.run.progress) impl.run.progress({"finding up", 0, 0, {}});
  UpDirection up = find_up(impl.seen_patches(), impl.state.corrected, impl.clues);
  impl.state.levelled = impl.chooses_frame && up.known();
  if (impl.state.levelled) {
    // The first camera keeps its heading.
    const Mat3 R_map_camera = impl.state.corrected.front().T_world_base.rotation();
    const Mat3 R_turned_map =
        level_pose(R_map_camera.transpose() * up.up).rotation() * R_map_camera.transpose();
    if (const double tilt = std::acos(std::clamp(up.up.z(), -1.0, 1.0)); tilt > kLeast_rad) {
      turn(impl.state, R_turned_map);
      impl.map.set_turn(R_turned_map);
      impl.state.levelled_rad = tilt;
    }
    up.up = Vec3::UnitZ();
  } else if (up.known()) {
    up.up = snapped_to_axis(up.up);
  }
  impl.state.up = up;
}

const FrameSource& SlamPipeline::frames() const { return impl_->source; }
UpDirection SlamPipeline::up() const { return impl_->state.up; }
TriangleMesh SlamPipeline::mesh_of_odometry(bool keyframes_alone) {
  return impl_->map.mesh_of_odometry(keyframes_alone);
}

Result<void> SlamPipeline::correct_dense_map() {
  Impl& impl = *impl_;
  if (const std::string& why = impl.map.out_of_memory(); !why.empty())
    return fail(ErrorCode::kOutOfMemory, "map", "{}", why);
  impl.state.correction = impl.map.correct(*impl.state.keyframes);
  impl.state.frames_mapped = impl.map.frames_mapped();
  if (const std::string& why = impl.state.correction.out_of_memory; !why.empty())
    return fail(ErrorCode::kOutOfMemory, "correcting the map", "{}", why);
  return {};
}

}  // namespace hm
