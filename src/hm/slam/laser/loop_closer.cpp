#include "hm/slam/laser/loop_closer.hpp"

namespace hm {
namespace {

/// Loops with a larger correction cause an optimisation of the whole graph.
constexpr double kLargeCorrection_m = 0.3;

}  // namespace

std::optional<ScanGraphStep> LoopCloser::add(const PlanarScan& scan, const OdometryStep& step) {
  const auto keyframe = keyframes_.add(scan, step);
  return keyframe ? std::optional(add(*keyframe)) : std::nullopt;
}

ScanGraphStep LoopCloser::add(const GraphKeyframe2D& keyframe) {
  const ScanGraphStep result = graph_.add_keyframe(keyframe);
  new_loops_ += result.loops_accepted;
  large_correction_ |= result.largest_correction_m > kLargeCorrection_m;
  if (new_loops_ >= loops_per_solution_) solve(large_correction_);
  return result;
}

PoseGraphSolution LoopCloser::solve(bool whole) {
  new_loops_ = 0;
  large_correction_ = false;
  ++solutions_;
  return graph_.optimise(window_.next(graph_.size(), whole));
}

PoseGraphSolution LoopCloser::finish() { return solve(true); }

}  // namespace hm
