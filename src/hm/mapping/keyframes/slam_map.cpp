#include "hm/mapping/keyframes/slam_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "hm/core/check.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/mapping/live_map_correction.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {
namespace {

MapRebuildOptions rebuild_options(const MappingParams& parameters) {
  MapRebuildOptions options;
  options.least_shift_m = parameters.slam.rebuild_shift_voxel * parameters.tsdf.voxel_size_m;
  options.prefetch_frames = static_cast<std::size_t>(parameters.reconstruction.prefetch_frames);
  return options;
}

/// Pose of a frame after loop closure; nothing in a submap that is not connected with the first one. A submap
/// not yet in the loop closures keeps its pose.
std::optional<SE3> place(const CorrectedKeyframes& corrected, const Observation& observation) {
  const auto& keyframes = corrected.keyframes();
  if (keyframes.empty()) return observation.T_odom_camera;
  if (observation.stamp >= keyframes.back().stamp && keyframes.back().submap != observation.submap)
    return observation.T_map_camera;
  if (corrected.map_at(observation.stamp) != 0) return std::nullopt;
  return corrected.T_map_camera(observation.stamp, observation.T_odom_camera);
}

}  // namespace

struct SlamMap::Impl {
  Impl(const MappingParams& all, const FrameSource& its_frames, const RunContext& its_run)
      : parameters(all),
        frames(its_frames),
        run(its_run),
        options(rebuild_options(all)),
        dense(all, its_frames.camera(), its_run.threads) {
    run.stop = {};  // a stopped run ends with a correct map of the frames so far
  }

  MappingParams parameters;
  const FrameSource& frames;
  RunContext run;
  MapRebuildOptions options;
  DensePipeline dense;
  ObservationLog log;
  std::unique_ptr<LiveMapCorrection> live;  ///< created by the first loop
  LiveRgbdLoopCloser::Snapshot now;         ///< poses after loop closure
  std::size_t solutions_begun = 0;          ///< solutions applied to the map or to the running rebuild
  LiveCorrection under_way;
  SE3 T_turned_map;  ///< about the origin
  std::vector<LiveCorrection> corrections;
  std::string out_of_memory;
  bool live_stopped = false;  ///< live rebuilding ran out of memory
  /// The frames of an earlier run: not in the map, being brought into it, or in it.
  enum class Earlier { kMissing, kUnderWay, kInMap } earlier = Earlier::kInMap;

  bool can_rebuild();
  void exchange(MapRebuild& rebuild, const RgbdFrame& frame);
  void begin(const RgbdFrame& frame);
  [[nodiscard]] Observation turned(Observation observation) const;
  [[nodiscard]] PoseOfObservation final_poses(const CorrectedKeyframes& keyframes) const;
  [[nodiscard]] MapRebuild whole_rebuild() const;
};

SlamMap::SlamMap(const MappingParams& parameters, const FrameSource& frames, const RunContext& run)
    : impl_(std::make_unique<Impl>(parameters, frames, run)) {}
SlamMap::~SlamMap() = default;

DensePipeline& SlamMap::dense() { return impl_->dense; }
const DensePipeline& SlamMap::dense() const { return impl_->dense; }
const std::string& SlamMap::out_of_memory() const { return impl_->out_of_memory; }
std::size_t SlamMap::frames_mapped() const { return impl_->log.frames_mapped(); }
std::vector<Observation> SlamMap::observations() const { return impl_->log.observations(); }
const std::vector<LiveCorrection>& SlamMap::corrections() const { return impl_->corrections; }

std::string SlamMap::progress() const {
  std::string text = fmt::format("map {} MB", impl_->dense.grid().map_bytes() / 1'000'000);
  if (!impl_->live || !impl_->live->busy()) return text;
  const LiveMapCorrection::State state = impl_->live->state();
  return text + fmt::format(", rebuilding {}/{}", state.frames_done, state.frames_total);
}

void SlamMap::Impl::exchange(MapRebuild& rebuild, const RgbdFrame& frame) {
  if (const auto put = rebuild.put_into(dense, log); !put) out_of_memory = put.error().message;
  if (earlier == Earlier::kUnderWay) earlier = Earlier::kInMap;
  if (rebuild.report().volumes_rebuilt == 0 && rebuild.report().frames_moved == 0) return;
  under_way.frame_index = frame.index;
  under_way.stamp = frame.stamp;
  under_way.map = rebuild.report();
  corrections.push_back(under_way);
}

void SlamMap::Impl::begin(const RgbdFrame& frame) {
  const Stopwatch watch;
  if (!live) {
    MapRebuildOptions moved_only = options;
    moved_only.extent = RebuildExtent::kMoved;
    live = std::make_unique<LiveMapCorrection>(parameters, frames, moved_only, run.background);
  }
  solutions_begun = now.solutions;
  if (earlier == Earlier::kMissing) earlier = Earlier::kUnderWay;
  live->start(log, [corrected = now.corrected](const Observation& o) { return place(*corrected, o); });
  under_way = {};
  under_way.begun = frame.stamp;
  under_way.stall_ms = watch.milliseconds();
}

/// True unless a rebuild is running or live rebuilding ran out of memory, which is logged once.
bool SlamMap::Impl::can_rebuild() {
  if (!live) return true;
  if (live->busy() || live_stopped) return false;
  const std::string why = live->out_of_memory();
  if (why.empty()) return true;
  live_stopped = true;
  if (run.log) run.log(LogLevel::kWarning, why + "; the map is not rebuilt any more while frames come in");
  return false;
}

void SlamMap::follow(const LiveRgbdLoopCloser::Snapshot& now, const RgbdFrame& frame) {
  Impl& impl = *impl_;
  if (!impl.parameters.slam.rebuild_online || !impl.out_of_memory.empty()) return;
  impl.now = now;
  const Stopwatch watch;
  const bool is_being_saved = impl.dense.grid().snapshot_under_way();  // it is exchanged afterwards
  if (auto rebuild = impl.live && !is_being_saved ? impl.live->take() : nullptr) {
    const std::size_t before = impl.corrections.size();
    impl.exchange(*rebuild, frame);
    impl.live->discard(std::move(rebuild));
    if (impl.corrections.size() > before) impl.corrections.back().stall_ms += watch.milliseconds();
  }
  const bool is_wanted = now.solutions != impl.solutions_begun || impl.earlier == Impl::Earlier::kMissing;
  if (is_wanted && impl.can_rebuild()) impl.begin(frame);
}

void SlamMap::restore(std::span<const Observation> earlier) {
  HM_CHECK(impl_->log.observations().empty(), "frames have been added");
  for (const Observation& observation : earlier) impl_->log.note(observation, {});
  if (!earlier.empty()) impl_->earlier = Impl::Earlier::kMissing;
}

bool SlamMap::is_complete() const { return impl_->earlier == Impl::Earlier::kInMap; }

std::optional<SE3> pose_in_map(const LiveRgbdLoopCloser::Snapshot& now, const TrackedFrame& tracked) {
  const SE3& T_odom_camera = *tracked.T_odom_camera;
  if (now.solutions == 0) return tracked.submap == 0 ? std::optional(T_odom_camera) : std::nullopt;
  const CorrectedKeyframe& last = now.corrected->keyframes().back();
  if (last.submap != tracked.submap || last.map != 0) return std::nullopt;
  return now.corrected->T_map_odom() * T_odom_camera;
}

bool SlamMap::add(RgbdFrame& frame, const TrackedFrame& tracked) {
  Impl& impl = *impl_;
  if (!impl.out_of_memory.empty()) return false;
  const Observation observation{frame.index, frame.stamp, tracked.submap, *tracked.T_odom_camera,
                                pose_in_map(impl.now, tracked)};
  if (!observation.T_map_camera) {
    impl.log.note(observation, {});
    return true;
  }
  frame.T_world_camera = observation.T_map_camera;
  const FrameOutcome outcome = impl.dense.process_in_map(frame);
  impl.out_of_memory = outcome.scan.out_of_memory;
  if (!outcome.integrated) return false;
  impl.log.note(observation, outcome.scan.changed);
  if (impl.live) impl.live->follow(observation, outcome.scan.changed, std::move(frame));
  return true;
}

void SlamMap::set_threads(int threads) {
  impl_->run.threads = threads;
  impl_->dense.set_threads(threads);
}

void SlamMap::set_turn(const Mat3& R_turned_map) { impl_->T_turned_map = {R_turned_map, Vec3::Zero()}; }

Observation SlamMap::Impl::turned(Observation observation) const {
  if (T_turned_map.rotation().isIdentity(0)) return observation;
  observation.T_odom_camera = T_turned_map * observation.T_odom_camera;
  if (observation.T_map_camera) observation.T_map_camera = T_turned_map * *observation.T_map_camera;
  return observation;
}

/// Final poses by one decision for all frames, so that it does not depend on the state of the map.
PoseOfObservation SlamMap::Impl::final_poses(const CorrectedKeyframes& keyframes) const {
  double largest_m = 0;
  for (const Observation& raw : log.observations()) {
    const Observation observation = turned(raw);
    if (const auto pose = place(keyframes, observation))
      largest_m = std::max(largest_m, shift_m(observation.T_odom_camera, *pose, options.at_depth_m));
  }
  if (largest_m > options.least_shift_m)
    return [this, &keyframes](const Observation& o) { return place(keyframes, turned(o)); };
  return [this, &keyframes](const Observation& o) -> std::optional<SE3> {
    const Observation observation = turned(o);
    if (!place(keyframes, observation)) return std::nullopt;
    return observation.T_odom_camera;
  };
}

MapRebuild SlamMap::Impl::whole_rebuild() const {
  MapRebuildOptions whole = options;
  whole.extent = RebuildExtent::kWhole;
  whole.threads = run.threads;
  return MapRebuild(parameters, frames, whole);
}

MapCorrection SlamMap::correct(const CorrectedKeyframes& keyframes) {
  Impl& impl = *impl_;
  impl.live.reset();
  const PoseOfObservation pose = impl.final_poses(keyframes);
  const std::vector<Observation> all = impl.log.observations();
  const bool is_there = std::all_of(all.begin(), all.end(), [&](const Observation& o) {
    const auto wanted = pose(o);
    return wanted.has_value() == o.T_map_camera.has_value() &&
           (!wanted || shift_m(*o.T_map_camera, *wanted, impl.options.at_depth_m) == 0);
  });
  MapCorrection nothing;
  nothing.frames = all.size();
  nothing.volumes_before = nothing.volumes_after = impl.dense.grid().volume_count();
  if (is_there && impl.corrections.empty()) return nothing;
  MapRebuild rebuild = impl.whole_rebuild();
  return correct_map(impl.dense, impl.log, rebuild, pose, impl.run);
}

TriangleMesh SlamMap::mesh_of_odometry(bool keyframes_alone) {
  Impl& impl = *impl_;
  std::set<std::size_t> keyframes;
  if (keyframes_alone && impl.now.corrected)
    for (const CorrectedKeyframe& keyframe : impl.now.corrected->keyframes())
      keyframes.insert(keyframe.frame_index);
  const auto odometry = [&](const Observation& o) {
    const bool wanted = o.submap == 0 && (keyframes.empty() || keyframes.contains(o.frame_index));
    return wanted ? std::optional(impl.turned(o).T_odom_camera) : std::nullopt;
  };
  if (impl.now.solutions == 0 && impl.T_turned_map.rotation().isIdentity(0))
    return impl.dense.finished_mesh();
  MapRebuild rebuild = impl.whole_rebuild();
  impl.log.close();
  RunContext run = impl.run;
  run.progress = [this](const Progress& progress) {
    if (impl_->run.progress)
      impl_->run.progress({"mapping odometry's poses, to compare", progress.done, progress.total, {}});
  };
  if (rebuild.replay(impl.log, odometry, run)) return rebuild.take_mesh();
  if (impl.run.log)
    impl.run.log(LogLevel::kWarning, rebuild.report().out_of_memory + "; odometry's map is left out");
  return {};
}

}  // namespace hm
