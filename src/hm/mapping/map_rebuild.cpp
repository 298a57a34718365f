#include "hm/mapping/map_rebuild.hpp"

#include <algorithm>
#include <new>

#include "hm/core/check.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {
namespace {

DenseParams without_mesh(DenseParams parameters) {
  parameters.reconstruction.live_mesh = false;
  return parameters;
}

bool any_of(std::span<const VolumeKey> keys, const std::set<VolumeKey>& wanted) {
  return std::any_of(keys.begin(), keys.end(), [&](const VolumeKey& key) { return wanted.contains(key); });
}

}  // namespace

double shift_m(const SE3& before, const SE3& after, double depth_m) {
  if (before.rotation() == after.rotation() && before.translation() == after.translation()) return 0;
  const SE3 change = before.inverse() * after;
  return std::max(1e-12, change.translation().norm() + change.angle() * depth_m);
}

MapRebuild::MapRebuild(const DenseParams& parameters, const FrameSource& frames,
                       const MapRebuildOptions& options)
    : frames_(frames),
      options_(options),
      aside_(without_mesh(parameters), frames.camera(), options.threads),
      whole_(options.extent == RebuildExtent::kWhole) {}
MapRebuild::~MapRebuild() = default;

/// Plans the rebuild. A group counts as moved when one of its frames has moved, since volumes are recorded
/// per group.
void MapRebuild::plan(Groups groups, const PoseOfObservation& pose_now) {
  std::size_t frames_moved = 0;
  for (std::size_t place = 0; place < groups.size(); ++place) {
    ObservationLog::Group now;
    bool moved = false;
    for (Observation observation : groups[place]->observations) {
      const std::optional<SE3> pose = pose_now(observation), before = observation.T_map_camera;
      if (!pose && !before) {
        now.observations.push_back(observation);
        continue;
      }
      ++report_.frames;
      report_.frames_removed += !pose;
      const double shift = pose && before ? shift_m(*before, *pose, options_.at_depth_m) : 0;
      report_.largest_shift_m = std::max(report_.largest_shift_m, shift);
      moved = moved || !pose || !before || shift > options_.least_shift_m;
      observation.T_map_camera = pose;
      now.observations.push_back(observation);
    }
    if (moved) {
      moved_.insert(place);
      frames_moved += now.observations.size();
      wanted_.insert(groups[place]->volumes.begin(), groups[place]->volumes.end());
    }
    if (moved || whole_) rebuilt_[place] = std::move(now);
  }
  if (2 * frames_moved <= report_.frames) return;
  whole_ = true;  // cheaper than finding the unaffected part
  for (std::size_t place = 0; place < groups.size(); ++place)
    if (!rebuilt_.contains(place)) rebuilt_[place].observations = groups[place]->observations;
}

/// Groups that still have to be integrated; their number grows when moved frames observe new volumes.
std::vector<std::size_t> MapRebuild::next_places(Groups groups) const {
  std::vector<std::size_t> places;
  for (std::size_t place = 0; place < groups.size(); ++place)
    if (!done_.contains(place) &&
        (whole_ || moved_.contains(place) || any_of(groups[place]->volumes, wanted_)))
      places.push_back(place);
  return places;
}

void MapRebuild::integrate_frame(std::size_t place, Observation& observation, Result<RgbdFrame>& frame) {
  const bool moved = moved_.contains(place);
  if (!frame) {
    ++report_.frames_lost;
    if (moved || whole_) observation.T_map_camera.reset();
    return;
  }
  frame->T_world_camera = observation.T_map_camera;
  const FrameOutcome outcome = aside_.process_in_map(*frame);
  report_.out_of_memory = outcome.scan.out_of_memory;
  if (!report_.out_of_memory.empty()) return;
  ++(moved ? report_.frames_moved : report_.frames_replayed);
  ObservationLog::Group& group = rebuilt_.at(place);
  for (const ChangedVolume& volume : outcome.scan.changed) {
    group.volumes.push_back(volume.key);
    if (moved && !whole_) wanted_.insert(volume.key);
  }
}

bool MapRebuild::integrate(std::span<const std::size_t> places, const RunContext& run) {
  std::vector<std::size_t> indices;
  std::vector<std::pair<std::size_t, Observation*>> jobs;
  for (const std::size_t place : places)
    for (Observation& observation : rebuilt_.at(place).observations)
      if (observation.T_map_camera) {
        jobs.emplace_back(place, &observation);
        indices.push_back(observation.frame_index);
      }
  frames_total_ += jobs.size();
  FramePrefetcher frames(frames_, std::move(indices),
                         {.ahead = options_.prefetch_frames, .readers = options_.threads});
  for (const auto& [place, observation] : jobs) {
    if (run.stop.stop_requested()) return false;
    auto frame = frames.next();
    HM_CHECK(frame.has_value(), "{} frames were to be read", jobs.size());
    integrate_frame(place, *observation, *frame);
    if (!report_.out_of_memory.empty()) return false;
    ++frames_done_;
    if (run.progress) run.progress({"correcting the map", frames_done_, frames_total_, {}});
  }
  return true;
}

bool MapRebuild::replay(const ObservationLog& log, const PoseOfObservation& pose_now, const RunContext& run) {
  const Stopwatch watch;
  const Groups groups = log.groups();
  plan(groups, pose_now);
  while (!is_empty()) {
    const std::vector<std::size_t> places = next_places(groups);
    if (places.empty()) break;
    for (const std::size_t place : places)  // unmoved ones keep their other changed volumes
      if (!rebuilt_.contains(place)) rebuilt_[place] = *groups[place];
    report_.interrupted = !integrate(places, run);
    if (report_.interrupted) break;
    done_.insert(places.begin(), places.end());
  }
  for (auto& [place, group] : rebuilt_) sort_and_unite(group.volumes);
  report_.seconds = watch.seconds();
  return !report_.interrupted;
}

void MapRebuild::follow(const Observation& observation, std::span<const VolumeKey> changed,
                        std::optional<RgbdFrame> images) {
  if (report_.interrupted || !observation.T_map_camera || is_empty() ||
      (!whole_ && !any_of(changed, wanted_)))
    return;
  auto frame = images ? Result<RgbdFrame>(std::move(*images)) : frames_.read(observation.frame_index);
  if (!frame) {
    ++report_.frames_lost;
    return;
  }
  frame->T_world_camera = observation.T_map_camera;
  report_.out_of_memory = aside_.process_in_map(*frame).scan.out_of_memory;
  report_.interrupted = !report_.out_of_memory.empty();
  ++report_.frames_replayed;
}

Result<void> MapRebuild::put_into(DensePipeline& map, ObservationLog& log) {
  HM_CHECK(!report_.interrupted, "it was stopped");
  try {
    exchange(map, log);
  } catch (const std::bad_alloc&) {
    report_.out_of_memory = "out of memory: the map and what was rebuilt of it do not fit beside each other";
    return fail(ErrorCode::kOutOfMemory, "map", "{}", report_.out_of_memory);
  }
  return {};
}

void MapRebuild::exchange(DensePipeline& map, ObservationLog& log) {
  report_.volumes_before = report_.volumes_after = map.grid().volume_count();
  if (is_empty()) return;
  report_.volumes_rebuilt = whole_ ? report_.volumes_before : wanted_.size();
  if (whole_)
    map.swap_grid(aside_.grid());
  else
    map.replace(std::vector<VolumeKey>(wanted_.begin(), wanted_.end()), aside_.grid());
  for (auto& [place, group] : rebuilt_) log.replace(place, std::move(group));
  rebuilt_.clear();
  report_.volumes_after = map.grid().volume_count();
}

MapCorrection correct_map(DensePipeline& map, ObservationLog& log, MapRebuild& rebuild,
                          const PoseOfObservation& pose_now, const RunContext& run) {
  log.close();
  if (rebuild.replay(log, pose_now, run))
    static_cast<void>(rebuild.put_into(map, log));  // a failure is in the report
  return rebuild.report();
}

}  // namespace hm
