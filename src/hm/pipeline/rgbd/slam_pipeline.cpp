#include "hm/pipeline/rgbd/slam_pipeline.hpp"

#include <algorithm>

#include "hm/core/stopwatch.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/pipeline/common/frame_range.hpp"
#include "hm/pipeline/rgbd/odometry_run.hpp"

namespace hm {
namespace {

/// Where the first frame is taken to be.
SE3 first_camera(const RecordingInfo& info, std::size_t first_frame, bool at_pose) {
  if (at_pose && first_frame < info.stamps.size())
    for (const StampedPose& pose : true_trajectory(info))
      if (pose.stamp >= info.stamps[first_frame]) return pose.T_world_base;
  return level_camera();
}

}  // namespace

struct SlamPipeline::Impl {
  Impl(const Recording& its_recording, const Parameters& all, const RunContext& its_run)
      : recording(its_recording),
        parameters(all),
        run(its_run),
        camera(recording.info().camera.without_distortion()),
        range(frame_range(all.reconstruction, recording.info().frame_count)),
        tracking(all, camera,
                 {range.count(), first_camera(recording.info(), range.begin, all.slam.start_at_pose),
                  recording.info().imu}),
        closer(camera, all.loops),
        map(all, recording, its_run) {
    if (all.slam.align) alignment.emplace(all, camera);
  }

  void take(std::size_t index, Result<RgbdFrame>& frame, double wait_ms);
  void align(const RgbdFrame& frame, TrackedFrame& tracked);
  [[nodiscard]] bool is_for_map() const;
  void show_progress() const;
  void place_trajectory();

  const Recording& recording;
  Parameters parameters;
  RunContext run;
  PinholeCamera camera;
  FrameRange range;
  VisualTracking tracking;
  LiveRgbdLoopCloser closer;
  SlamMap map;
  std::optional<SlamAlignment> alignment;
  Trajectory aligned;  ///< instead of the tracking's, with alignment; and its keyframes
  std::vector<std::shared_ptr<const Keyframe>> aligned_keyframes;
  std::vector<double> frame_ms;
  State state;
};

SlamPipeline::SlamPipeline(const Recording& recording, const Parameters& parameters, const RunContext& run)
    : impl_(std::make_unique<Impl>(recording, parameters, run)) {}
SlamPipeline::~SlamPipeline() = default;

const SlamPipeline::State& SlamPipeline::state() const { return impl_->state; }
SlamPipeline::State& SlamPipeline::state() { return impl_->state; }
DensePipeline& SlamPipeline::dense() { return impl_->map.dense(); }

/// From here on odometry is what alignment made of it.
void SlamPipeline::Impl::align(const RgbdFrame& frame, TrackedFrame& tracked) {
  if (!alignment || !tracked.T_odom_camera) return;
  alignment->align(frame, tracked);
  aligned.push_back({frame.stamp, *tracked.T_odom_camera});
  if (tracked.new_keyframe) aligned_keyframes.push_back(tracked.new_keyframe);
}

/// Of the frames with a pose, the last one included.
bool SlamPipeline::Impl::is_for_map() const {
  return (tracking.track().frames_tracked - 1) % static_cast<std::size_t>(parameters.slam.map_stride) == 0;
}

void SlamPipeline::Impl::take(std::size_t index, Result<RgbdFrame>& frame, double wait_ms) {
  const Stopwatch watch;
  TrackedFrame tracked = tracking.take(index, frame, wait_ms);
  if (frame) align(*frame, tracked);
  if (tracked.new_keyframe && parameters.loops.enabled) closer.add(tracked.new_keyframe);
  if (frame) {
    frame->index = index;
    map.follow(closer.snapshot(), *frame);
    if (tracked.T_odom_camera && is_for_map()) map.add(*frame, tracked);
    frame_ms.push_back(watch.milliseconds());
  }
  show_progress();
}

void SlamPipeline::Impl::show_progress() const {
  if (!run.progress) return;
  const VisualTrack& track = tracking.track();
  const auto loops = closer.snapshot();
  run.progress({"tracking", track.frames_read + track.unused.size(), track.frames_total,
                fmt::format("{} keyframes, {} loops, {} lost, {}", track.keyframes.size(),
                            loops.statistics.accepted, track.frames_lost, map.progress())});
}

Result<void> SlamPipeline::track_and_map(const AfterFrame& after_frame) {
  Impl& impl = *impl_;
  const Stopwatch watch;
  FramePrefetcher frames(impl.recording, impl.range.begin, impl.range.end, impl.range.stride,
                         static_cast<std::size_t>(impl.parameters.reconstruction.prefetch_frames));
  std::size_t index = impl.range.begin;
  while (!impl.run.stop.stop_requested()) {
    const Stopwatch wait;
    auto frame = frames.next();
    if (!frame) break;
    impl.take(index, *frame, wait.milliseconds());
    index += impl.range.stride;
    if (after_frame)
      if (const auto done = after_frame(index); !done) return done;
  }
  impl.state.frames_total = impl.range.count();
  impl.state.frames_done = std::min(index, impl.range.end);
  impl.state.interrupted = index < impl.range.end;
  impl.state.frame_ms = summarise(impl.frame_ms);
  impl.state.live_corrections = impl.map.corrections();
  impl.state.seconds = watch.seconds();
  return {};
}

Trajectory SlamPipeline::trajectory_now() const {
  const auto corrected = impl_->closer.snapshot().corrected;
  Trajectory now;
  for (const StampedPose& pose : impl_->alignment ? impl_->aligned : impl_->tracking.track().trajectory)
    if (corrected->map_at(pose.stamp) == 0)
      now.push_back(
          {pose.stamp, corrected->T_map_camera(pose.stamp, pose.T_world_base).value_or(pose.T_world_base)});
  return now;
}

/// Brings odometry's poses into the map.
void SlamPipeline::Impl::place_trajectory() {
  const CorrectedKeyframes& corrected = *state.keyframes;
  state.corrected.clear();
  for (const StampedPose& pose : state.track.trajectory) {
    if (corrected.map_at(pose.stamp) != 0) {
      ++state.frames_apart;
      continue;
    }
    const auto placed = corrected.T_map_camera(pose.stamp, pose.T_world_base);
    const SE3 T_map_camera = placed ? *placed : pose.T_world_base;
    state.largest_shift_m = std::max(state.largest_shift_m,
                                     (T_map_camera.translation() - pose.T_world_base.translation()).norm());
    state.corrected.push_back({pose.stamp, T_map_camera});
  }
}

void SlamPipeline::close_loops() {
  Impl& impl = *impl_;
  const Stopwatch watch;
  if (impl.run.progress) impl.run.progress({"closing loops", 0, 0, {}});
  impl.state.alignment = impl.closer.finish();
  const auto snapshot = impl.closer.snapshot();
  impl.state.keyframes = snapshot.corrected;
  impl.state.loops = snapshot.statistics;
  impl.state.graph = impl.closer.graph();
  impl.state.track = impl.tracking.finish();
  if (impl.alignment) {
    impl.state.track.trajectory = std::move(impl.aligned);
    impl.state.track.keyframes = std::move(impl.aligned_keyframes);
    impl.state.dense_alignment = impl.alignment->summary();
  }
  impl.place_trajectory();
  impl.state.close_seconds = watch.seconds();
}

TriangleMesh SlamPipeline::mesh_of_odometry() { return impl_->map.mesh_of_odometry(); }

void SlamPipeline::correct_dense_map() {
  Impl& impl = *impl_;
  impl.state.correction = impl.map.correct(*impl.state.keyframes);
  impl.state.frames_mapped = impl.map.frames_mapped();
}

}  // namespace hm
