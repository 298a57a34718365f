#include "hm/slam/loop_closer.hpp"

namespace hm {

std::optional<ScanGraphStep> LoopCloser::add(const PlanarScan& scan, const OdometryStep& step) {
  if (!step.new_keyframe || !step.T_odom_base) return std::nullopt;
  // After a restart nobody knows how far the vehicle is from the keyframe before.
  const Mat3 covariance = step.status == OdometryStatus::kTracking
                              ? step.match.covariance
                              : Mat3(kFreeDirectionVariance_m2 * Mat3::Identity());
  ScanGraphStep result = graph_.add_keyframe({scan, *step.T_odom_base, covariance});
  new_loops_ += result.loops_accepted;
  if (new_loops_ >= loops_per_solution_) finish();
  return result;
}

PoseGraphSolution LoopCloser::finish() {
  new_loops_ = 0;
  ++solutions_;
  return graph_.optimise();
}

}  // namespace hm
