#include "hm/slam/laser/graph_keyframes.hpp"

#include <cmath>

#include "hm/geometry/planar_covariance.hpp"

namespace hm {
namespace {

/// A match leaves no direction freer than this: the free directions of two matches differ by a little, and a
/// sum of unbounded ones would leave the heading free too.
constexpr double kMostFree_m = 0.5, kMostFree_rad = 0.5;

/// Covariance of a step's match along the axes of `odom`.
Mat3 match_in_odom(const OdometryStep& step) {
  const bool matched = step.status == OdometryStatus::kTracking || step.status == OdometryStatus::kFound;
  if (!matched || !step.T_keyframe_base) return Mat3::Zero();
  const SE2 T_odom_keyframe = *step.T_odom_base * step.T_keyframe_base->inverse();
  const Mat3 bound = Vec3(kMostFree_m, kMostFree_m, kMostFree_rad).cwiseAbs2().asDiagonal();
  return turned_covariance(T_odom_keyframe.rotation(), fused_covariance(step.match.covariance, bound));
}

}  // namespace

std::optional<GraphKeyframe2D> GraphKeyframes::add(const PlanarScan& scan, const OdometryStep& step,
                                                   double height_m) {
  if (!step.T_odom_base) return std::nullopt;
  const Mat3 match = match_in_odom(step);
  unknown_since_ = unknown_since_ || step.status == OdometryStatus::kRestarted;
  if (!step.wheel_covariance)
    wheels_since_.reset();
  else if (wheels_since_)
    *wheels_since_ += *step.wheel_covariance;
  std::optional<GraphKeyframe2D> result;
  if (is_due(*step.T_odom_base)) {
    result = GraphKeyframe2D{scan, *step.T_odom_base, covariance_since_last(match),
                             wheel_covariance_since_last(), height_m};
    T_odom_last_ = step.T_odom_base;
    last_match_ = match;
    keyframes_since_.setZero();
    wheels_since_ = Mat3::Zero();
    unknown_since_ = false;
  }
  if (step.new_keyframe) keyframes_since_ += match;
  return result;
}

bool GraphKeyframes::is_due(const SE2& T_odom_base) const {
  if (!T_odom_last_ || unknown_since_) return true;
  const SE2 motion = T_odom_last_->inverse() * T_odom_base;
  return motion.translation().norm() > params_.kGraphDistance_m ||
         std::abs(motion.angle()) > params_.kGraphAngle_rad;
}

/// Sums the covariances of both keyframes' matches and of the odometry keyframes between them, which are
/// independent. After a restart of odometry the motion since the last keyframe is unknown.
Mat3 GraphKeyframes::covariance_since_last(const Mat3& match_odom) const {
  if (unknown_since_) return kFreeDirectionVariance_m2 * Mat3::Identity();
  if (!T_odom_last_) return Mat3::Zero();
  return turned_covariance(T_odom_last_->rotation().transpose(), last_match_ + keyframes_since_ + match_odom);
}

/// Each wheel motion begins with a heading that was matched, so that their errors are independent.
std::optional<Mat3> GraphKeyframes::wheel_covariance_since_last() const {
  if (unknown_since_ || !T_odom_last_ || !wheels_since_) return std::nullopt;
  return turned_covariance(T_odom_last_->rotation().transpose(), *wheels_since_);
}

}  // namespace hm
