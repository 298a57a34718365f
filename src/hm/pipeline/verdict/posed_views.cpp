#include "hm/pipeline/verdict/posed_views.hpp"

#include <algorithm>
#include <utility>

#include "hm/core/parallel.hpp"
#include "hm/pipeline/checks/image_motion.hpp"
#include "hm/pipeline/checks/pose_agreement.hpp"

namespace hm {
namespace {

std::optional<RgbdFrame> posed(Result<RgbdFrame> frame, const PosedView& view) {
  if (!frame) return std::nullopt;
  frame->T_world_camera = view.T_world_camera;
  return std::move(*frame);
}

std::optional<ViewDifference> difference(const Recording& recording, const PosedView& a, const PosedView& b) {
  constexpr double kMinOverlapRatio = 0.3;  // views with less of their points in common say nothing
  const auto first = posed(recording.read_depth(a.index), a),
             second = posed(recording.read_depth(b.index), b);
  if (!first || !second) return std::nullopt;
  const Agreement there = compare(*first, *second, recording.camera(), {});
  if (there.overlap_ratio < kMinOverlapRatio) return std::nullopt;
  const Agreement back = compare(*second, *first, recording.camera(), {});
  return ViewDifference{std::max(there.contradicted_ratio, back.contradicted_ratio),
                        std::min(there.systematic, back.systematic), std::min(there.tilt_rad, back.tilt_rad)};
}

std::optional<double> color_difference_rad(const Recording& recording, const PosedView& a,
                                           const PosedView& b) {
  // Below these a motion may be chance: a blank wall, a pattern that repeats.
  constexpr double kMinLikeness = 0.6, kMinGain = 0.2;
  const auto first = posed(recording.read(a.index), a), second = posed(recording.read(b.index), b);
  if (!first || !second) return std::nullopt;
  const auto motion = image_motion(*first, *second, recording.camera());
  if (!motion || motion->likeness < kMinLikeness) return std::nullopt;
  const bool is_moved = motion->likeness - motion->unmoved_likeness >= kMinGain;
  return is_moved ? motion->angle_rad(recording.camera()) : 0;
}

}  // namespace

std::vector<PosedView> posed_views(const RecordingInfo& info, const Trajectory& T_world_camera) {
  std::vector<PosedView> views;
  auto pose = T_world_camera.begin();
  for (std::size_t i = 0; i < info.stamps.size(); ++i) {
    while (pose != T_world_camera.end() && pose->stamp < info.stamps[i]) ++pose;
    if (pose == T_world_camera.end()) break;
    if (pose->stamp == info.stamps[i])
      views.push_back({i, (info.stamps[i] - info.stamps.front()).seconds(), pose->T_world_base});
  }
  return views;
}

double turning_rad_s(const PosedView& before, const PosedView& after) {
  const double elapsed_s = after.time_s - before.time_s;
  if (!(elapsed_s > 0)) return 0;
  return (before.T_world_camera.inverse() * after.T_world_camera).log().tail<3>().norm() / elapsed_s;
}

std::vector<std::optional<ViewDifference>> differences(const Recording& recording,
                                                       const std::vector<PosedView>& views,
                                                       std::span<const ViewPair> pairs, const RunContext& run,
                                                       const char* stage) {
  const ParallelLoop loop(run.threads);
  const std::size_t at_once = std::max<std::size_t>(8, 4 * static_cast<std::size_t>(run.threads));
  std::vector<std::optional<ViewDifference>> found(pairs.size());
  for (std::size_t done = 0; done < pairs.size(); done += at_once) {
    if (run.progress) run.progress({stage, done, pairs.size(), {}});
    loop.for_ranges(std::min(at_once, pairs.size() - done), 1, [&](std::size_t i, std::size_t) {
      const ViewPair& pair = pairs[done + i];
      found[done + i] = difference(recording, views[pair.first], views[pair.second]);
    });
  }
  return found;
}

std::vector<std::optional<double>> color_differences_rad(const Recording& recording,
                                                         const std::vector<PosedView>& views,
                                                         std::span<const ViewPair> pairs,
                                                         const RunContext& run) {
  std::vector<std::optional<double>> found(pairs.size());
  ParallelLoop(run.threads).for_ranges(pairs.size(), 1, [&](std::size_t i, std::size_t) {
    found[i] = color_difference_rad(recording, views[pairs[i].first], views[pairs[i].second]);
  });
  return found;
}

}  // namespace hm
