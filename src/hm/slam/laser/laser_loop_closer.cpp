#include "hm/slam/laser/laser_loop_closer.hpp"

namespace hm {
namespace {

/// After a loop with a larger correction the whole graph is optimised at once: the next search is around the
/// graph's estimate, in a window as narrow as this loop has made its uncertainty.
constexpr double kLargeCorrection_m = 0.3, kLargeTurn_rad = 0.04;

}  // namespace

std::optional<ScanGraphStep> LaserLoopCloser::add(const PlanarScan& scan, const OdometryStep& step) {
  const auto keyframe = keyframes_.add(scan, step);
  return keyframe ? std::optional(add(*keyframe)) : std::nullopt;
}

ScanGraphStep LaserLoopCloser::add(const GraphKeyframe2D& keyframe) {
  const ScanGraphStep result = graph_.add_keyframe(keyframe);
  new_loops_ += result.loops_accepted;
  const bool is_large =
      result.largest_correction_m > kLargeCorrection_m || result.largest_turn_rad > kLargeTurn_rad;
  if (is_large || new_loops_ >= loops_per_solution_) solve(is_large);
  return result;
}

PoseGraphSolution LaserLoopCloser::solve(bool whole) {
  new_loops_ = 0;
  ++solutions_;
  return graph_.optimise(window_.next(graph_.size(), whole));
}

PoseGraphSolution LaserLoopCloser::finish() { return solve(true); }

}  // namespace hm
