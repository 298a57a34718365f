#include "hm/pipeline/verdict/depth_visits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "hm/pipeline/verdict/path_steps.hpp"
#include "hm/pipeline/verdict/posed_views.hpp"

namespace hm {
namespace {

constexpr std::size_t kMaxFrames = 60;
constexpr VisitLimits kLimits{3, 0.2, 0.5, 0.4};
/// Relative differences of depth, in the worst window. True poses of real recordings reach 0.024.
constexpr double kDoubtfulOffsetRatio = 0.03, kBrokenOffsetRatio = 0.06;
constexpr double kApart_s = 2, kNear_m = 1, kNear_rad = std::numbers::pi / 6;

bool turns_fast(const std::vector<PosedView>& views, std::size_t of) {
  return turning_rad_s(views[of - std::min<std::size_t>(of, 1)], views[std::min(of + 1, views.size() - 1)]) >=
         kMaxTurning_rad_s;
}

/// Distance and angle of two views, as shares of what is near; beyond 1 they do not show the same.
double view_distance(const SE3& a, const SE3& b) {
  const double forward = std::clamp(a.rotation().col(2).dot(b.rotation().col(2)), -1.0, 1.0);
  return std::max((a.translation() - b.translation()).norm() / kNear_m, std::acos(forward) / kNear_rad);
}

/// Earlier views of the same place: the last one that lies kApart_s back, which shows a sudden error of the
/// path, and the first one of all, which shows what has added up. None, one or two.
std::vector<std::size_t> earlier_visits(const std::vector<PosedView>& views, std::size_t of) {
  const PosedView& view = views[of];
  const auto is_visit = [&](std::size_t j) {
    return view_distance(view.T_world_camera, views[j].T_world_camera) < 1 && !turns_fast(views, j);
  };
  std::vector<std::size_t> visits;
  std::size_t end = of;
  while (end > 0 && view.time_s - views[end - 1].time_s < kApart_s) --end;
  for (std::size_t j = end; j-- > 0 && visits.empty();)
    if (is_visit(j)) visits.push_back(j);
  for (std::size_t j = 0; !visits.empty() && j < visits.front(); ++j)
    if (is_visit(j)) return {visits.front(), j};
  return visits;
}

/// Views all over the path, each with the earlier visits of its place; the pairs of a view follow each other.
std::vector<ViewPair> pairs_of_visits(const std::vector<PosedView>& views) {
  std::vector<ViewPair> pairs;
  const std::size_t wanted = std::min(kMaxFrames, views.size());
  for (std::size_t k = 0; k < wanted; ++k) {
    const std::size_t of = (k + 1) * views.size() / wanted - 1;
    if (turns_fast(views, of)) continue;
    for (const std::size_t visit : earlier_visits(views, of)) pairs.push_back({of, visit});
  }
  return pairs;
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
  const std::vector<PosedView> views = posed_views(recording.info(), T_world_camera);
  std::vector<VisitComparison> comparisons;
  std::vector<double> offset_ratios;
  const std::vector<ViewPair> pairs = pairs_of_visits(views);
  const auto found = differences(recording, views, pairs, run, "comparing visits");
  std::optional<std::size_t> last;  // view that was compared
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!found[i]) continue;
    const PosedView& view = views[pairs[i].first];
    if (last != pairs[i].first) {
      last = pairs[i].first;
      comparisons.push_back({view.time_s, 0, view.T_world_camera.translation().head<2>()});
      offset_ratios.push_back(0);
    }
    comparisons.back().contradicted_ratio =
        std::max(comparisons.back().contradicted_ratio, found[i]->contradicted_ratio);
    offset_ratios.back() = std::max(offset_ratios.back(), found[i]->offset_ratio);
  }
  judge_visits(comparisons, kLimits, "depth images", verdict);
  judge_offsets(comparisons, offset_ratios, verdict);
  judge_steps(recording, views, run, verdict);
}

}  // namespace hm
