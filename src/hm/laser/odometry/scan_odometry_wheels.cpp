#include <Eigen/LU>
#include <cmath>

#include "hm/geometry/planar_covariance.hpp"
#include "hm/laser/odometry/scan_odometry.hpp"

/// What wheels say about a scan's pose, and what its pose says about the wheels.
namespace hm {
namespace {

/// A match may differ so much from wheel odometry, in deviations of both; those of a match, besides its
/// noise.
constexpr double kMostWheelDeviations = 4, kMatchError_m = 0.03, kMatchError_rad = 0.01;
/// A pose counts as held after this motion, though few pairs hold it.
constexpr double kMostHeld_m = 0.5, kMostHeld_rad = 0.3;
/// Motions that teach the calibration of the wheels: in shorter ones the errors of matches count for more.
constexpr double kLearnedWay_m = 0.3, kLearnedTurn_rad = 0.3;
/// Share of its points that a match must pair for wheels to confirm it.
constexpr double kSurePairsRatio = 0.15;

}  // namespace

/// A pose from which all motion is to be measured anew.
void ScanOdometry::begin_motion() { matched_ = held_ = learned_ = {T_odom_base_, since_keyframe_}; }

/// By the wheels since the last pose that was held: from one scan to the next, few wrong pairs may shift a
/// pose less than wheels err, again and again, until it stands.
PredictedPose ScanOdometry::predicted() const {
  if (!held_.wheels) return {matched_.pose()};
  return {held_.pose(), compose_covariance(held_.T_odom_base, held_.covariance, held_.predicted,
                                           wheels_.covariance(*held_.wheels))};
}

/// A pose's deviation from the prediction by wheels, squared and in deviations of both: of its place, and of
/// its heading too. Nothing where wheels do not predict it.
std::optional<ScanOdometry::WheelDeviation> ScanOdometry::deviation_from_wheels(
    const SE2& T_odom_base) const {
  const PredictedPose pose = predicted();
  if (!pose.covariance) return std::nullopt;
  Vec3 error = T_odom_base.vector() - pose.T_odom_base.vector();
  error.z() = wrap_angle(error.z());
  const Mat3 covariance =
      *pose.covariance + Mat3(Vec3(kMatchError_m, kMatchError_m, kMatchError_rad).cwiseAbs2().asDiagonal());
  const Mat2 of_place = covariance.topLeftCorner<2, 2>();
  return WheelDeviation{error.head<2>().dot(of_place.inverse() * error.head<2>()),
                        error.dot(covariance.inverse() * error)};
}

/// Whether a match lies where wheels may have brought the vehicle. Its heading counts more than theirs.
bool ScanOdometry::agrees_with_wheels(const ScanMatch& match) const {
  const auto deviation = deviation_from_wheels(matched_pose(match));
  return !deviation || deviation->place_chi2 <= kMostWheelDeviations * kMostWheelDeviations;
}

/// Whether wheels alone make a match certain: it is as good as those that are not searched for, and what
/// they measured.
bool ScanOdometry::confirmed_by_wheels(const ScanMatch& match) const {
  if (!match.ok() || match.mean_error_m > params_.kFindMaxError_m ||
      static_cast<double>(match.pairs) < kSurePairsRatio * static_cast<double>(match.sensed_points))
    return false;
  const auto deviation = deviation_from_wheels(matched_pose(match));
  return deviation && deviation->chi2 <= kMostWheelDeviations * kMostWheelDeviations;
}

/// Where matching contradicts the wheels, they say nothing about this motion.
void ScanOdometry::judge_wheels(const SE2& T_odom_base, OdometryStep& step) {
  const auto deviation = deviation_from_wheels(T_odom_base);
  if (deviation && deviation->chi2 > kMostWheelDeviations * kMostWheelDeviations)
    step.wheel_covariance.reset();
}

/// Learns from motions that are long enough to tell something, over several scans where these are close.
void ScanOdometry::learn_wheels(const OdometryStep& step) {
  const Mat3 match = turned_covariance(T_odom_keyframe_.rotation(), step.match.covariance);
  if (step.confirmed && learned_.wheels && params_.matcher.compute_covariance) {
    if (learned_.wheels->translation().norm() < kLearnedWay_m &&
        std::abs(learned_.wheels->angle()) < kLearnedTurn_rad)
      return;
    wheels_.learn(
        *learned_.wheels, learned_.T_odom_base.inverse() * *step.T_odom_base,
        turned_covariance(learned_.T_odom_base.rotation().transpose(), learned_.covariance + match));
  }
  learned_ = {*step.T_odom_base, match};
}

/// Motion is measured from the last pose that more than few pairs held, or that lies far enough from such a
/// one. Of other poses only the heading counts: the wheels' way goes on along it.
void ScanOdometry::hold(const ScanMatch& match) {
  if (match.weak.count == 0 || !held_.wheels || held_.predicted.translation().norm() > kMostHeld_m ||
      std::abs(held_.predicted.angle()) > kMostHeld_rad)
    held_ = matched_;
  else
    held_.predicted = SE2(held_.predicted.translation(), T_odom_base_.angle() - held_.T_odom_base.angle());
}

}  // namespace hm
