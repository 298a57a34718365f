#include "hm/slam/laser/laser_loop_closer.hpp"

#include "hm/slam/laser/loop_revision.hpp"

namespace hm {
std::optional<ScanGraphStep> LaserLoopCloser::add(const PlanarScan& scan, const OdometryStep& step) {
  const auto keyframe = keyframes_.add(scan, step);
  return keyframe ? std::optional(add(*keyframe)) : std::nullopt;
}

ScanGraphStep LaserLoopCloser::add(const GraphKeyframe2D& keyframe) {
  const ScanGraphStep result = graph_.add_keyframe(keyframe);
  new_loops_ += result.loops_accepted;
  if (result.corrects_much() || new_loops_ >= loops_per_solution_) solve(result.corrects_much());
  return result;
}

PoseGraphSolution LaserLoopCloser::solve(bool whole) {
  new_loops_ = 0;
  ++solutions_;
  return graph_.optimise(window_.next(graph_.size(), whole));
}

PoseGraphSolution LaserLoopCloser::finish() {
  const PoseGraphSolution solution = solve(true);
  if (const LoopRevision revision = revise_loops(graph_); revision.changes == 0) return solution;
  return solve(true);
}

}  // namespace hm
