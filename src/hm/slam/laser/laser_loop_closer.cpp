#include "hm/slam/laser/laser_loop_closer.hpp"

#include <fmt/core.h>

#include "hm/core/text/counted.hpp"

namespace hm {

std::optional<ScanGraphStep> LaserLoopCloser::add(const PlanarScan& scan, const OdometryStep& step,
                                                  double height_m) {
  const auto keyframe = keyframes_.add(scan, step, height_m);
  return keyframe ? std::optional(add(*keyframe)) : std::nullopt;
}

ScanGraphStep LaserLoopCloser::add(const GraphKeyframe2D& keyframe) {
  if (registration_.registered > 0) {
    solve(true);
    registration_ = {};
  }
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

PoseGraphSolution LaserLoopCloser::finish(const RunContext& run) {
  const auto show = [&](const LoopRevision& revision) {
    if (run.progress)
      run.progress(
          {"closing loops", 0, 0,
           fmt::format("the map contradicts itself: trial {} of {} at most, {} searched again",
                       revision.trials, kMostRevisionTrials, counted(revision.searched, "keyframe"))});
  };
  PoseGraphSolution solution = solve(true);
  revision_ = revise_loops(graph_, {run.stop, show});
  if (revision_.changes > 0) solution = solve(true);
  registration_ = register_keyframes(graph_, run);
  return solution;
}

}  // namespace hm
