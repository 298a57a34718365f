#include "hm/pipeline/slam_pipeline.hpp"

#include <algorithm>

#include "hm/core/stopwatch.hpp"
#include "hm/pipeline/dense_pipeline.hpp"
#include "hm/pipeline/frame_range.hpp"
#include "hm/pipeline/odometry_run.hpp"

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
                 {range.count(), first_camera(recording.info(), range.begin, all.slam.start_at_pose)}),
        closer(camera, all.loops),
        dense(all, camera, its_run.threads) {}

  void take(std::size_t index, Result<RgbdFrame>& frame, double wait_ms);
  void map(RgbdFrame& frame, const TrackedFrame& tracked);
  void show_progress() const;
  void place_trajectory();

  const Recording& recording;
  Parameters parameters;
  RunContext run;
  PinholeCamera camera;
  FrameRange range;
  VisualTracking tracking;
  LiveRgbdLoopCloser closer;
  DensePipeline dense;
  ObservationLog log;
  std::vector<Observation> later;  ///< frames of later submaps: in the map once a loop has connected them
  std::vector<double> map_ms;
  State state;
};

SlamPipeline::SlamPipeline(const Recording& recording, const Parameters& parameters, const RunContext& run)
    : impl_(std::make_unique<Impl>(recording, parameters, run)) {}
SlamPipeline::~SlamPipeline() = default;

const SlamPipeline::State& SlamPipeline::state() const { return impl_->state; }
SlamPipeline::State& SlamPipeline::state() { return impl_->state; }
DensePipeline& SlamPipeline::dense() { return impl_->dense; }
const ObservationLog& SlamPipeline::observations() const { return impl_->log; }

/// A frame of the first submap goes into the map at once, those of later ones when their place is known.
void SlamPipeline::Impl::map(RgbdFrame& frame, const TrackedFrame& tracked) {
  if ((tracking.track().frames_tracked - 1) % static_cast<std::size_t>(parameters.slam.map_stride) != 0)
    return;
  const Observation observation{frame.index, frame.stamp, *tracked.T_odom_camera};
  if (tracked.submap > 0) return later.push_back(observation);
  const Stopwatch watch;
  frame.T_world_camera = tracked.T_odom_camera;
  const FrameOutcome outcome = dense.process(frame);
  if (outcome.integrated) log.note(observation, outcome.scan.changed);
  map_ms.push_back(watch.milliseconds());
}

void SlamPipeline::Impl::take(std::size_t index, Result<RgbdFrame>& frame, double wait_ms) {
  const TrackedFrame tracked = tracking.take(index, frame, wait_ms);
  if (tracked.new_keyframe && parameters.loops.enabled) closer.add(tracked.new_keyframe);
  if (frame && tracked.T_odom_camera) {
    frame->index = index;
    map(*frame, tracked);
  }
  show_progress();
}

void SlamPipeline::Impl::show_progress() const {
  if (!run.progress) return;
  const VisualTrack& track = tracking.track();
  const auto loops = closer.snapshot();
  run.progress(
      {"tracking", track.frames_read + track.unused.size(), track.frames_total,
       fmt::format("{} keyframes, {} loops, {} lost, map {} MB", track.keyframes.size(),
                   loops.statistics.accepted, track.frames_lost, dense.grid().map_bytes() / 1'000'000)});
}

void SlamPipeline::track_and_map() {
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
  }
  impl.state.frames_total = impl.range.count();
  impl.state.interrupted = index < impl.range.end;
  impl.state.map_ms = summarise(impl.map_ms);
  impl.state.seconds = watch.seconds();
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
  impl.place_trajectory();
  impl.state.close_seconds = watch.seconds();
}

void SlamPipeline::correct_dense_map() {
  Impl& impl = *impl_;
  const CorrectedKeyframes& corrected = *impl.state.keyframes;
  const Trajectory& odometry = impl.state.track.trajectory;
  const auto pose_now = [&](const Observation& observation) -> std::optional<SE3> {
    if (corrected.map_at(observation.stamp) != 0) return std::nullopt;
    const auto at = std::lower_bound(odometry.begin(), odometry.end(), observation.stamp,
                                     [](const StampedPose& pose, Time stamp) { return pose.stamp < stamp; });
    if (at == odometry.end() || at->stamp != observation.stamp) return std::nullopt;
    const auto placed = corrected.T_map_camera(at->stamp, at->T_world_base);
    return placed ? *placed : at->T_world_base;
  };
  MapCorrectionOptions options;
  options.least_shift_m = impl.parameters.slam.rebuild_shift_voxel * impl.parameters.tsdf.voxel_size_m;
  options.prefetch_frames = static_cast<std::size_t>(impl.parameters.reconstruction.prefetch_frames);
  impl.log.add_unmapped(impl.later);
  impl.later.clear();
  impl.state.correction = correct_map(impl.dense, impl.log, impl.recording, pose_now, options, impl.run);
  impl.state.interrupted = impl.state.interrupted || impl.state.correction.interrupted;
  impl.state.frames_mapped = 0;
  for (const auto& group : impl.log.groups()) impl.state.frames_mapped += group.observations.size();
}

}  // namespace hm
