#include "hm/pipeline/verdict/depth_visits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "hm/pipeline/checks/pose_agreement.hpp"

namespace hm {
namespace {

constexpr std::size_t kMaxFrames = 60;
constexpr VisitLimits kLimits{3, 0.2, 0.5, 0.4};
/// Relative differences of depth, in the worst window. True poses of real recordings reach 0.024.
constexpr double kDoubtfulOffsetRatio = 0.03, kBrokenOffsetRatio = 0.06;
constexpr double kMaxTurning_rad_s = 1;
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

/// Angular velocity between a frame's neighbours. Where a camera turns fast, rows and depth image are of
/// other moments than the stamp, and even the true pose does not place them rightly.
double turning_rad_s(const std::vector<VisitedFrame>& frames, std::size_t of) {
  const VisitedFrame &before = frames[of - std::min<std::size_t>(of, 1)],
                     &after = frames[std::min(of + 1, frames.size() - 1)];
  const double elapsed_s = after.time_s - before.time_s;
  if (!(elapsed_s > 0)) return 0;
  return (before.T_world_camera.inverse() * after.T_world_camera).log().tail<3>().norm() / elapsed_s;
}

/// Distance and angle of two views, as shares of what is near; beyond 1 they do not show the same.
double view_distance(const SE3& a, const SE3& b) {
  const double forward = std::clamp(a.rotation().col(2).dot(b.rotation().col(2)), -1.0, 1.0);
  return std::max((a.translation() - b.translation()).norm() / kNear_m, std::acos(forward) / kNear_rad);
}

/// Earlier views of the same place: the last one that lies kApart_s back, which shows a sudden error of the
/// path, and the first one of all, which shows what has added up. None, one or two.
std::vector<std::size_t> earlier_visits(const std::vector<VisitedFrame>& frames, std::size_t of) {
  const VisitedFrame& frame = frames[of];
  const auto is_visit = [&](std::size_t j) {
    return view_distance(frame.T_world_camera, frames[j].T_world_camera) < 1 &&
           turning_rad_s(frames, j) < kMaxTurning_rad_s;
  };
  std::vector<std::size_t> visits;
  std::size_t end = of;
  while (end > 0 && frame.time_s - frames[end - 1].time_s < kApart_s) --end;
  for (std::size_t j = end; j-- > 0 && visits.empty();)
    if (is_visit(j)) visits.push_back(j);
  for (std::size_t j = 0; !visits.empty() && j < visits.front(); ++j)
    if (is_visit(j)) return {visits.front(), j};
  return visits;
}

std::optional<RgbdFrame> read(const Recording& recording, const VisitedFrame& visited) {
  auto frame = recording.read(visited.index);
  if (!frame) return std::nullopt;
  frame->T_world_camera = visited.T_world_camera;
  return std::move(*frame);
}

/// How far two views of a place differ.
struct ViewDifference {
  double contradicted_ratio = 0;  ///< of either view's points, in the free space of the other: the larger
  double offset_ratio = 0;        ///< of depth, averaged over tiles of the image, either way: the smaller
};

std::optional<ViewDifference> difference(const RgbdFrame& a, const RgbdFrame& b,
                                         const PinholeCamera& camera) {
  const Agreement there = compare(a, b, camera, {});
  if (there.overlap_ratio < kMinOverlapRatio) return std::nullopt;
  const Agreement back = compare(b, a, camera, {});
  return ViewDifference{std::max(there.contradicted_ratio, back.contradicted_ratio),
                        std::min(there.systematic, back.systematic)};
}

/// Of a frame and the earlier visits of its place, the largest; none where no view overlaps.
std::optional<ViewDifference> difference(const Recording& recording, const std::vector<VisitedFrame>& frames,
                                         std::size_t of) {
  const std::vector<std::size_t> visits = earlier_visits(frames, of);
  if (visits.empty()) return std::nullopt;
  const auto frame = read(recording, frames[of]);
  if (!frame) return std::nullopt;
  std::optional<ViewDifference> worst;
  for (const std::size_t visit : visits) {
    const auto earlier = read(recording, frames[visit]);
    const auto found = earlier ? difference(*frame, *earlier, recording.camera()) : std::nullopt;
    if (!found) continue;
    if (!worst) worst.emplace();
    worst->contradicted_ratio = std::max(worst->contradicted_ratio, found->contradicted_ratio);
    worst->offset_ratio = std::max(worst->offset_ratio, found->offset_ratio);
  }
  return worst;
}

/// Adds what a systematic difference of depth says: turns of a few degrees move hardly a point into free
/// space, but tilt what is seen.
void judge_offsets(const std::vector<VisitComparison>& comparisons, const std::vector<double>& offset_ratios,
                   RunVerdict& verdict) {
  if (comparisons.empty()) return;
  const WindowMedians windows = window_medians(offset_ratios, kLimits.window);
  verdict.visits->worst_offset_ratio = windows.worst;
  if (windows.worst <= kDoubtfulOffsetRatio) return;
  verdict.add(windows.worst > kBrokenOffsetRatio ? MapVerdict::kBroken : MapVerdict::kDoubtful,
              fmt::format("around {:.1f} s after the start, depth images differ by {:.1f} % from those of "
                          "another visit",
                          comparisons[windows.worst_index].time_s, 100 * windows.worst));
}

}  // namespace

void judge_depth_visits(const Recording& recording, const Trajectory& T_world_camera, const RunContext& run,
                        RunVerdict& verdict) {
  const std::vector<VisitedFrame> frames = visited_frames(recording.info(), T_world_camera);
  std::vector<VisitComparison> comparisons;
  std::vector<double> offset_ratios;
  const std::size_t wanted = std::min(kMaxFrames, frames.size());
  for (std::size_t k = 0; k < wanted; ++k) {
    const std::size_t of = (k + 1) * frames.size() / wanted - 1;
    if (turning_rad_s(frames, of) >= kMaxTurning_rad_s) continue;
    if (run.progress) run.progress({"comparing visits", k, wanted, {}});
    const auto found = difference(recording, frames, of);
    if (!found) continue;
    comparisons.push_back(
        {frames[of].time_s, found->contradicted_ratio, frames[of].T_world_camera.translation().head<2>()});
    offset_ratios.push_back(found->offset_ratio);
  }
  judge_visits(comparisons, kLimits, "depth images", verdict);
  judge_offsets(comparisons, offset_ratios, verdict);
}

}  // namespace hm
