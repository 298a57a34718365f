#include "hm/pipeline/map_correction.hpp"

#include <algorithm>
#include <numeric>
#include <set>

#include "hm/core/stopwatch.hpp"

namespace hm {
namespace {

constexpr std::size_t kGroupFrames = 15;

/// Sorts and keeps each key once.
void tidy(std::vector<VolumeKey>& keys) {
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  keys.shrink_to_fit();
}

bool intersects(const std::vector<VolumeKey>& sorted, const std::set<VolumeKey>& wanted) {
  return std::any_of(sorted.begin(), sorted.end(),
                     [&](const VolumeKey& key) { return wanted.contains(key); });
}

/// How far a reading at this depth moves, at most about.
double shift_m(const SE3& before, const SE3& after, double depth_m) {
  const SE3 change = before.inverse() * after;
  return change.translation().norm() + change.angle() * depth_m;
}

/// One run of correct_map().
class Correction {
 public:
  Correction(DensePipeline& pipeline, const Recording& recording, const MapCorrectionOptions& options,
             const RunContext& run)
      : pipeline_(pipeline), recording_(recording), options_(options), run_(run) {}

  MapCorrection correct(ObservationLog& log, const PoseOfObservation& pose_now);

 private:
  struct Plan {
    std::vector<ObservationLog::Group> moved, still;  ///< moved ones with their new poses
    std::set<VolumeKey> rebuilt;
  };
  Plan plan(const ObservationLog& log, const PoseOfObservation& pose_now);
  void replay_still(const Plan& plan);
  void integrate_moved(const Plan& plan, ObservationLog& log);
  using Integrate = std::function<void(const Observation&, const RgbdFrame&)>;
  void for_each_frame(const std::vector<ObservationLog::Group>& groups, const Integrate& integrate);
  void show_progress();

  DensePipeline& pipeline_;
  const Recording& recording_;
  const MapCorrectionOptions& options_;
  const RunContext& run_;
  MapCorrection result_;
  std::size_t done_ = 0, total_ = 0;
};

void Correction::show_progress() {
  ++done_;
  if (run_.progress) run_.progress({"correcting the map", done_, total_, {}});
}

/// A group moves as a whole when one of its frames does, as its volumes are known together only.
Correction::Plan Correction::plan(const ObservationLog& log, const PoseOfObservation& pose_now) {
  Plan plan;
  for (const ObservationLog::Group& group : log.groups()) {
    ObservationLog::Group now;
    bool moved = !group.mapped;
    for (const Observation& observation : group.observations) {
      ++result_.frames;
      const std::optional<SE3> pose = pose_now(observation);
      moved = moved || !pose;
      if (!pose) {
        ++result_.frames_removed;
        continue;
      }
      result_.frames_added += !group.mapped;
      const double shift = shift_m(observation.T_map_camera, *pose, options_.at_depth_m);
      result_.largest_shift_m = std::max(result_.largest_shift_m, shift);
      moved = moved || shift > options_.least_shift_m;
      now.observations.push_back({observation.frame_index, observation.stamp, *pose});
    }
    if (!moved) {
      plan.still.push_back(group);
      continue;
    }
    plan.rebuilt.insert(group.volumes.begin(), group.volumes.end());
    plan.moved.push_back(std::move(now));
  }
  return plan;
}

void Correction::for_each_frame(const std::vector<ObservationLog::Group>& groups,
                                const Integrate& integrate) {
  for (const ObservationLog::Group& group : groups) {
    if (group.observations.empty()) continue;
    const std::size_t first = group.observations.front().frame_index,
                      last = group.observations.back().frame_index;
    std::size_t stride = 0;
    for (const Observation& observation : group.observations)
      stride = std::gcd(stride, observation.frame_index - first);
    stride = std::max<std::size_t>(stride, 1);
    FramePrefetcher frames(recording_, first, last + 1, stride, options_.prefetch_frames);
    auto next = group.observations.begin();
    for (std::size_t index = first; index <= last && next != group.observations.end(); index += stride) {
      if (run_.stop.stop_requested()) {
        result_.interrupted = true;
        return;
      }
      auto frame = frames.next();
      if (!frame) break;
      if (index != next->frame_index) continue;
      if (*frame) {
        (*frame)->T_world_camera = next->T_map_camera;
        integrate(*next, **frame);
      } else {
        ++result_.frames_lost;
      }
      ++next;
      show_progress();
    }
  }
}

/// Frames that did not move write into what was cleared alone: through a grid of their own.
void Correction::replay_still(const Plan& plan) {
  std::vector<ObservationLog::Group> seen_it;
  for (const ObservationLog::Group& group : plan.still)
    if (intersects(group.volumes, plan.rebuilt)) seen_it.push_back(group);
  if (seen_it.empty()) return;
  for (const auto& group : seen_it) total_ += group.observations.size();
  const std::vector<VolumeKey> wanted(plan.rebuilt.begin(), plan.rebuilt.end());
  pipeline_.begin_aside();
  for_each_frame(seen_it, [&](const Observation&, const RgbdFrame& frame) {
    pipeline_.process_aside(frame);
    ++result_.frames_replayed;
  });
  pipeline_.take_aside(wanted);
}

void Correction::integrate_moved(const Plan& plan, ObservationLog& log) {
  for_each_frame(plan.moved, [&](const Observation& observation, const RgbdFrame& frame) {
    const FrameOutcome outcome = pipeline_.process_in_map(frame);
    if (!outcome.integrated) return;
    ++result_.frames_moved;
    log.note(observation, outcome.scan.changed);
  });
}

MapCorrection Correction::correct(ObservationLog& log, const PoseOfObservation& pose_now) {
  const Stopwatch watch;
  const Plan what = plan(log, pose_now);
  result_.volumes_before = pipeline_.grid().volume_count();
  result_.volumes_rebuilt = what.rebuilt.size();
  for (const auto& group : what.moved) total_ += group.observations.size();
  ObservationLog after;
  after.restart_with(what.still);
  pipeline_.release(std::vector<VolumeKey>(what.rebuilt.begin(), what.rebuilt.end()));
  replay_still(what);
  integrate_moved(what, after);
  after.sort();
  log = std::move(after);
  result_.volumes_after = pipeline_.grid().volume_count();
  result_.seconds = watch.seconds();
  return result_;
}

}  // namespace

void ObservationLog::note(const Observation& observation, std::span<const ChangedVolume> changed) {
  const bool goes_on = groups_.size() > closed_ && groups_.back().observations.size() < kGroupFrames;
  if (!goes_on) {
    if (!groups_.empty()) tidy(groups_.back().volumes);
    closed_ = groups_.size();
    groups_.emplace_back();
  }
  Group& group = groups_.back();
  group.observations.push_back(observation);
  for (const ChangedVolume& volume : changed) group.volumes.push_back(volume.key);
  if (group.observations.size() % 4 == 0) tidy(group.volumes);
}

void ObservationLog::restart_with(std::vector<Group> groups) {
  groups_ = std::move(groups);
  closed_ = groups_.size();
}

void ObservationLog::add_unmapped(std::span<const Observation> observations) {
  for (std::size_t begin = 0; begin < observations.size(); begin += kGroupFrames) {
    const auto part = observations.subspan(begin, std::min(kGroupFrames, observations.size() - begin));
    groups_.push_back({{part.begin(), part.end()}, false, {}});
  }
  sort();
}

void ObservationLog::sort() {
  for (Group& group : groups_) tidy(group.volumes);
  std::stable_sort(groups_.begin(), groups_.end(), [](const Group& a, const Group& b) {
    return a.observations.front().frame_index < b.observations.front().frame_index;
  });
  closed_ = groups_.size();
}

std::size_t ObservationLog::bytes() const {
  std::size_t bytes = 0;
  for (const Group& group : groups_)
    bytes += group.volumes.capacity() * sizeof(VolumeKey) +
             group.observations.capacity() * sizeof(Observation) + sizeof(Group);
  return bytes;
}

MapCorrection correct_map(DensePipeline& pipeline, ObservationLog& log, const Recording& recording,
                          const PoseOfObservation& pose_now, const MapCorrectionOptions& options,
                          const RunContext& run) {
  return Correction(pipeline, recording, options, run).correct(log, pose_now);
}

}  // namespace hm
