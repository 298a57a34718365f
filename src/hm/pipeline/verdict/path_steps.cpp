#include "hm/pipeline/verdict/path_steps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <span>
#include <string>

#include "hm/core/angle.hpp"

namespace hm {
namespace {

constexpr std::size_t kMostSteps = 60;
constexpr std::size_t kMostColorSteps = 12;  ///< images are decoded for these
/// From where on a difference is doubtful, and broken.
struct StepLimits {
  double doubtful, broken;
};
/// Shares of points in the free space of the image before or after. True poses of real recordings, turning at
/// 3 rad/s among them, reach 0.10.
constexpr StepLimits kContradictedRatio{0.2, 0.5};
/// Relative differences of depth. True poses of real recordings reach 0.018.
constexpr StepLimits kStepOffsetRatio{0.025, 0.06};
/// Turns of what one image shows against the other. True poses of real recordings reach 0.048.
constexpr StepLimits kTilt_rad{0.06, 0.15};
/// Turns about the optical axis, and shifts as angles, of one colour image against the other, which depth
/// does not show on a wall. True poses of real recordings reach 0.032.
constexpr StepLimits kColor_rad{0.06, 0.15};

/// A step from a view to the next.
struct PathStep {
  std::size_t to = 0;     ///< the view at its end
  double jump_ratio = 0;  ///< of its motion, what the steps before and after do not explain
};

/// Motion from a view to the next, and how long it took.
struct StepMotion {
  Vec6 motion;  ///< in the frame of the first view
  double elapsed_s;
};
std::vector<StepMotion> motions_along(const std::vector<PosedView>& views) {
  std::vector<StepMotion> motions;
  for (std::size_t to = 1; to < views.size(); ++to)
    motions.push_back({(views[to - 1].T_world_camera.inverse() * views[to].T_world_camera).log(),
                       views[to].time_s - views[to - 1].time_s});
  return motions;
}

/// How large the difference of a step's motion is from a neighbour's, stretched to the same time: in units of
/// 2 cm or 1 degree.
double unlikeness(const StepMotion& step, const StepMotion& neighbour) {
  constexpr double kShift_m = 0.02, kTurn_rad = std::numbers::pi / 180;
  if (!(neighbour.elapsed_s > 0)) return 0;
  const Vec6 rest = step.motion - neighbour.motion * (step.elapsed_s / neighbour.elapsed_s);
  return std::max(rest.head<3>().norm() / kShift_m, rest.tail<3>().norm() / kTurn_rad);
}

/// The steps that are least like both of their neighbours, largest first.
std::vector<PathStep> suspicious_steps(const std::vector<PosedView>& views) {
  const std::vector<StepMotion> motions = motions_along(views);
  std::vector<PathStep> steps;
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const double before = i > 0 ? unlikeness(motions[i], motions[i - 1]) : 0;
    const double after = i + 1 < motions.size() ? unlikeness(motions[i], motions[i + 1]) : 0;
    steps.push_back({i + 1, std::min(before, after)});
  }
  std::ranges::stable_sort(steps, std::greater<>(), &PathStep::jump_ratio);
  steps.resize(std::min(steps.size(), kMostSteps));
  return steps;
}

/// By how much the camera turns while colour is exposed later or earlier than depth.
double turned_meanwhile_rad(const std::vector<PosedView>& views, const ViewPair& pair) {
  constexpr double kColorDelay_s = 0.02;
  return kColorDelay_s * turning_rad_s(views[pair.first], views[pair.second]);
}

std::string jump_text(const StepConsistency& step) {
  std::string text = fmt::format(
      "{:.1f} s after the start the path jumps: {:.0f} % of a depth image stands in the free space "
      "of the one before, depth differs by {:.1f} %, tilted by {:.1f} degrees",
      step.worst_time_s, 100 * step.contradicted_ratio, 100 * step.offset_ratio,
      step.tilt_rad * kDegreesPerRadian);
  if (step.color_rad)
    text += fmt::format(", colour moved by {:.1f} degrees", *step.color_rad * kDegreesPerRadian);
  return text;
}

}  // namespace

void judge_steps(const Recording& recording, const std::vector<PosedView>& views, const RunContext& run,
                 RunVerdict& verdict) {
  StepConsistency& found = verdict.steps.emplace();
  double worst = 0;
  std::vector<ViewPair> neighbours;
  for (const PathStep& step : suspicious_steps(views)) neighbours.push_back({step.to - 1, step.to});
  const auto all = differences(recording, views, neighbours, run, "comparing neighbours");
  const auto most_unlike = std::span(neighbours).first(std::min(neighbours.size(), kMostColorSteps));
  auto by_color = color_differences_rad(recording, views, most_unlike, run);
  by_color.resize(neighbours.size());
  for (std::size_t k = 0; k < neighbours.size(); ++k) {
    if (!all[k] && !by_color[k]) continue;
    const ViewDifference differs = all[k].value_or(ViewDifference());
    ++found.compared;
    const double gravity = std::max(
        {differs.contradicted_ratio / kContradictedRatio.doubtful,
         differs.offset_ratio / kStepOffsetRatio.doubtful, differs.tilt_rad / kTilt_rad.doubtful,
         by_color[k].value_or(0) / (kColor_rad.doubtful + turned_meanwhile_rad(views, neighbours[k]))});
    if (gravity <= worst) continue;
    worst = gravity;
    found.worst_time_s = views[neighbours[k].second].time_s;
    found.contradicted_ratio = differs.contradicted_ratio;
    found.offset_ratio = differs.offset_ratio;
    found.tilt_rad = differs.tilt_rad;
    found.color_rad = by_color[k];
  }
  if (worst <= 1) return;
  const bool broken = found.contradicted_ratio > kContradictedRatio.broken ||
                      found.offset_ratio > kStepOffsetRatio.broken || found.tilt_rad > kTilt_rad.broken ||
                      found.color_rad.value_or(0) > kColor_rad.broken;
  verdict.add(broken ? MapVerdict::kBroken : MapVerdict::kDoubtful, jump_text(found));
}

}  // namespace hm
