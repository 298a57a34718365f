#include "hm/slam/laser/laser_loop_closer.hpp"

namespace hm {

std::optional<ScanGraphStep> LaserLoopCloser::add(const PlanarScan& scan, const OdometryStep& step,
                                                  double height_m) {
  const auto keyframe = keyframes_.add(scan, step, height_m);
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

PoseGraphSolution LaserLoopCloser::finish(const RevisionContext& context) {
  const PoseGraphSolution solution = solve(true);
  revision_ = revise_loops(graph_, context);
  return revision_.changes == 0 ? solution : solve(true);
}

}  // namespace hm
