#include "hm/slam/laser/loop_closer.hpp"

#include <cmath>

#include "hm/geometry/planar_covariance.hpp"

namespace hm {
namespace {

/// Loops with a larger correction cause an optimisation of the whole graph.
constexpr double kLargeCorrection_m = 0.3;

/// Covariance of a step's match along the axes of `odom`.
Mat3 match_in_odom(const OdometryStep& step) {
  const bool matched = step.status == OdometryStatus::kTracking || step.status == OdometryStatus::kFound;
  if (!matched || !step.T_keyframe_base) return Mat3::Zero();
  const SE2 T_odom_keyframe = *step.T_odom_base * step.T_keyframe_base->inverse();
  return turned_covariance(T_odom_keyframe.rotation(), step.match.covariance);
}

}  // namespace

std::optional<ScanGraphStep> LoopCloser::add(const PlanarScan& scan, const OdometryStep& step) {
  if (!step.T_odom_base) return std::nullopt;
  const Mat3 match = match_in_odom(step);
  unknown_since_ = unknown_since_ || step.status == OdometryStatus::kRestarted;
  if (!step.wheel_covariance)
    wheels_since_.reset();
  else if (wheels_since_)
    *wheels_since_ += *step.wheel_covariance;
  std::optional<ScanGraphStep> result;
  if (wants_node(*step.T_odom_base)) {
    result = graph_.add_keyframe(
        {scan, *step.T_odom_base, covariance_since_last(match), wheel_covariance_since_last()});
    last_match_ = match;
    keyframes_since_.setZero();
    wheels_since_ = Mat3::Zero();
    unknown_since_ = false;
    new_loops_ += result->loops_accepted;
    large_correction_ |= result->largest_correction_m > kLargeCorrection_m;
    if (new_loops_ >= loops_per_solution_) solve(large_correction_);
  }
  if (step.new_keyframe) keyframes_since_ += match;
  return result;
}

bool LoopCloser::wants_node(const SE2& T_odom_base) const {
  if (graph_.size() == 0 || unknown_since_) return true;
  const SE2 motion = graph_.keyframe(graph_.size() - 1).T_odom_base.inverse() * T_odom_base;
  return motion.translation().norm() > params_.kGraphDistance_m ||
         std::abs(motion.angle()) > params_.kGraphAngle_rad;
}

/// Sums the covariances of both nodes' matches and of the keyframes between them, which are independent.
/// After a restart of odometry the motion since the last node is unknown.
Mat3 LoopCloser::covariance_since_last(const Mat3& match_odom) const {
  if (unknown_since_) return kFreeDirectionVariance_m2 * Mat3::Identity();
  if (graph_.size() == 0) return Mat3::Zero();
  const SE2& T_odom_last = graph_.keyframe(graph_.size() - 1).T_odom_base;
  return turned_covariance(T_odom_last.rotation().transpose(), last_match_ + keyframes_since_ + match_odom);
}

/// Each wheel motion begins with a heading that was matched, so that their errors are independent.
std::optional<Mat3> LoopCloser::wheel_covariance_since_last() const {
  if (unknown_since_ || graph_.size() == 0 || !wheels_since_) return std::nullopt;
  return turned_covariance(graph_.keyframe(graph_.size() - 1).T_odom_base.rotation().transpose(),
                           *wheels_since_);
}

PoseGraphSolution LoopCloser::solve(bool whole) {
  new_loops_ = 0;
  large_correction_ = false;
  ++solutions_;
  return graph_.optimise(window_.next(graph_.size(), whole));
}

PoseGraphSolution LoopCloser::finish() { return solve(true); }

}  // namespace hm
