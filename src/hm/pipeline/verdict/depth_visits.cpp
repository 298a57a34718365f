#include "hm/pipeline/verdict/depth_visits.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "hm/pipeline/checks/pose_agreement.hpp"

namespace hm {
namespace {

constexpr std::size_t kMaxPairs = 40;
constexpr VisitLimits kLimits{0.25, 0.5, 0.4};
constexpr double kApart_s = 2, kNear_m = 1, kNear_rad = std::numbers::pi / 6;
/// Views with less of their points in common say nothing.
constexpr double kMinOverlapRatio = 0.3;

struct VisitedFrame {
  std::size_t index;
  double time_s;
  SE3 T_world_camera;
};

/// Depth images that the trajectory has a pose for.
std::vector<VisitedFrame> visited_frames(const RecordingInfo& info, const Trajectory& T_world_camera) {
  std::vector<VisitedFrame> frames;
  auto pose = T_world_camera.begin();
  for (std::size_t i = 0; i < info.stamps.size(); ++i) {
    while (pose != T_world_camera.end() && pose->stamp < info.stamps[i]) ++pose;
    if (pose == T_world_camera.end()) break;
    if (pose->stamp == info.stamps[i])
      frames.push_back({i, (info.stamps[i] - info.stamps.front()).seconds(), pose->T_world_base});
  }
  return frames;
}

/// Distance and angle of two views, as shares of what is near; beyond 1 they do not show the same.
double view_distance(const SE3& a, const SE3& b) {
  const double forward = std::clamp(a.rotation().col(2).dot(b.rotation().col(2)), -1.0, 1.0);
  return std::max((a.translation() - b.translation()).norm() / kNear_m, std::acos(forward) / kNear_rad);
}

/// An earlier view of the same place: near it, and rather long before.
std::optional<std::size_t> earlier_visit(const std::vector<VisitedFrame>& frames, std::size_t of) {
  const VisitedFrame& frame = frames[of];
  std::optional<std::size_t> best;
  double best_score = 1;
  for (std::size_t j = 0; j < of && frame.time_s - frames[j].time_s >= kApart_s; ++j) {
    const double distance = view_distance(frame.T_world_camera, frames[j].T_world_camera);
    if (distance >= 1) continue;
    const double score = distance + 0.5 * frames[j].time_s / frame.time_s;
    if (best && score >= best_score) continue;
    best = j;
    best_score = score;
  }
  return best;
}

std::optional<Agreement> compare_frames(const Recording& recording, const VisitedFrame& from,
                                        const VisitedFrame& to) {
  auto first = recording.read(from.index), second = recording.read(to.index);
  if (!first || !second) return std::nullopt;
  FramePair pair{std::move(*first), std::move(*second)};
  pair.from.T_world_camera = from.T_world_camera;
  pair.to.T_world_camera = to.T_world_camera;
  const Agreement there = compare(pair, recording.camera(), {});
  if (there.overlap_ratio < kMinOverlapRatio) return std::nullopt;
  std::swap(pair.from, pair.to);
  const Agreement back = compare(pair, recording.camera(), {});
  return back.contradicted_ratio > there.contradicted_ratio ? back : there;
}

}  // namespace

std::vector<VisitComparison> compare_depth_visits(const Recording& recording,
                                                  const Trajectory& T_world_camera, const RunContext& run) {
  const std::vector<VisitedFrame> frames = visited_frames(recording.info(), T_world_camera);
  std::vector<VisitComparison> comparisons;
  const std::size_t wanted = std::min(kMaxPairs, frames.size());
  for (std::size_t k = 0; k < wanted; ++k) {
    const std::size_t of = (k + 1) * frames.size() / wanted - 1;
    const auto earlier = earlier_visit(frames, of);
    if (!earlier) continue;
    if (run.progress) run.progress({"comparing visits", k, wanted, {}});
    if (const auto agreement = compare_frames(recording, frames[of], frames[*earlier]))
      comparisons.push_back({frames[of].time_s, agreement->contradicted_ratio,
                             frames[of].T_world_camera.translation().head<2>()});
  }
  return comparisons;
}

void judge_depth_visits(const Recording& recording, const Trajectory& T_world_camera, const RunContext& run,
                        RunVerdict& verdict) {
  judge_visits(compare_depth_visits(recording, T_world_camera, run), kLimits, "depth images", verdict);
}

}  // namespace hm
