#include "hm/laser/odometry/scan_odometry.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "hm/geometry/planar_covariance.hpp"

namespace hm {

std::string_view to_string(OdometryStatus status) {
  switch (status) {
    case OdometryStatus::kFirstScan:
      return "first scan";
    case OdometryStatus::kTracking:
      return "tracking";
    case OdometryStatus::kFound:
      return "found";
    case OdometryStatus::kMatchFailed:
      return "match failed";
    case OdometryStatus::kRestarted:
      return "restarted";
    case OdometryStatus::kTimeBackwards:
      return "time backwards";
    case OdometryStatus::kTooFewPoints:
      return "too few points";
  }
  return "";
}

namespace {

constexpr double kLeastSpacingRatio = 0.5, kSpacingGain = 0.05;
/// Deviations of wheel odometry where nothing confirms it, and of a match that nothing confirms.
constexpr double kUnsureShift_m = 0.05, kUnsureTurn_rad = 0.05, kUnsureRatio = 0.2;
constexpr double kUnsure_m = 0.2, kUnsure_rad = 0.2;
/// Half of the acceleration that a match which nothing confirms may show.
constexpr double kMostHalfAcceleration_m_s2 = 4;
/// A free direction is one along walls if it moves so much more than it turns.
constexpr double kAlong = 0.9;
/// Standard deviation of the motion along walls from what the velocity predicts: half of an acceleration
/// times the time squared, within these. Stamps may say more time than it was: those of scans that waited in
/// a queue.
constexpr double kHalfAcceleration_m_s2 = 1.5, kLeastAlong_m = 0.02, kMostAlong_m = 0.1;
/// A search shows where the vehicle is along walls up to this deviation; by a larger one it is not moved, as
/// the velocity would follow what noise there is in the scores.
constexpr double kMostObserved_m = 0.1;
/// Few pairs may shift a match so far along walls, and the last scans must undo half of a larger shift.
constexpr double kWeakShift_m = 0.02, kMostOfWeakShift = 0.5;

}  // namespace

ScanOdometry::ScanOdometry(const ScanOdometryParams& params)
    : params_(params), matcher_(params.matcher), velocity_(params.kVelocityAlpha, params.kVelocityBeta) {}

void ScanOdometry::start(const SE2& T_odom_base) {
  last_stamp_.reset();
  T_odom_base_ = T_odom_keyframe_ = T_odom_base;
  keyframe_covariance_.setZero();
  since_keyframe_.setZero();
  begin_motion();
  keyframes_ = 0;
  failures_ = 0;
  velocity_.reset(T_odom_base_);
  unmatched_s_ = spacing_s_ = 0;
  along_variance_m2_ = observed_speed_m_s_ = 0;
  along_observed_ = false;
}

OdometryStep ScanOdometry::begin(const PlanarScan& scan) {
  OdometryStep step;
  step.stamp = scan.stamp;
  step.T_odom_base_predicted = T_odom_base_;
  if (scan.size() < static_cast<std::size_t>(params_.matcher.kMinPairs)) return step;
  matcher_.set_reference(scan);
  step.status = OdometryStatus::kFirstScan;
  step.T_odom_base = T_odom_base_;
  step.T_keyframe_base = SE2();
  step.new_keyframe = true;
  T_odom_keyframe_ = T_odom_base_;
  last_stamp_ = scan.stamp;
  velocity_.reset(T_odom_base_);
  return step;
}

SE2 ScanOdometry::predicted_motion(double dt_s, const MotionPrediction& prediction) const {
  SE2 motion;
  if (prediction.T_last_now)
    motion = wheels_.corrected(*prediction.T_last_now);
  else if (prediction.velocity_base)
    motion = SE2::exp(*prediction.velocity_base * dt_s);
  else if (params_.use_velocity && dt_s <= params_.kMaxGap_s)
    motion = SE2::exp(velocity_.velocity() * dt_s);
  if (prediction.yaw_change_rad) motion = SE2(motion.translation(), *prediction.yaw_change_rad);
  return motion;
}

/// The time in which a vehicle moved between two scans. Stamps of recordings may be those of a computer that
/// had other things to do: scans much closer than usual were not taken so close.
double ScanOdometry::motion_time(double dt_s) {
  const double time_s = std::max(dt_s, kLeastSpacingRatio * spacing_s_);
  if (dt_s <= params_.kMaxGap_s)
    spacing_s_ = spacing_s_ == 0 ? dt_s : spacing_s_ + kSpacingGain * (dt_s - spacing_s_);
  return time_s;
}

void ScanOdometry::predict(double motion_s, const MotionPrediction& prediction) {
  const SE2 motion = predicted_motion(motion_s, prediction);
  for (MotionSince* since : {&matched_, &held_, &learned_}) since->add(motion, prediction.T_last_now);
  unmatched_s_ += motion_s;
}

OdometryStep ScanOdometry::process(const PlanarScan& scan, const MotionPrediction& prediction) {
  if (!last_stamp_) return begin(scan);
  OdometryStep step;
  step.stamp = scan.stamp;
  step.keyframe = keyframes_;
  const double dt_s = (scan.stamp - *last_stamp_).seconds();
  if (!(dt_s > 0)) {
    step.status = OdometryStatus::kTimeBackwards;
    step.T_odom_base_predicted = matched_.pose();
    return step;
  }
  last_stamp_ = scan.stamp;
  step.after_gap = dt_s > params_.kMaxGap_s;
  const double motion_s = motion_time(dt_s);
  predict(motion_s, prediction);
  step.T_odom_base_predicted = matched_.pose();
  if (matched_.wheels)
    step.wheel_covariance = turned_covariance(T_odom_base_.rotation(), wheels_.covariance(*matched_.wheels));
  const Vec3 before = velocity_.velocity();
  match(scan, prediction, step);
  // A vehicle goes on as it went before it turned or waited, where the search finds out when it did not.
  if (step.after_gap && step.T_odom_base && prediction.confirms)
    velocity_.reset(*step.T_odom_base, {before.x(), before.y(), 0});
  return step;
}

ScanMatch ScanOdometry::match_once(const PlanarScan& scan, const PredictedPose& pose, double least_share) {
  std::optional<Mat3> covariance;
  if (pose.covariance)
    covariance = turned_covariance(T_odom_keyframe_.rotation().transpose(), *pose.covariance);
  return matcher_.match(scan, T_odom_keyframe_.inverse() * pose.T_odom_base, covariance, least_share);
}

/// Looks for a match that wheels confirm where that from the prediction is none, from other headings: true
/// with the one that has most pairs.
bool ScanOdometry::match_as_wheels(const PlanarScan& scan, OdometryStep& step) {
  if (confirmed_by_wheels(step.match)) return true;
  PredictedPose pose = predicted();
  if (!pose.covariance) return false;
  const double sigma_rad = std::sqrt((*pose.covariance)(2, 2));
  std::optional<double> best_rad;
  std::size_t most_pairs = 0;
  const SE2 T_odom_base = pose.T_odom_base;
  const auto match_turned = [&](double turn_rad) {
    pose.T_odom_base = T_odom_base * SE2(0, 0, turn_rad);
    step.match = match_once(scan, pose);
  };
  for (const double deviations : {-3.0, -1.5, 1.5, 3.0}) {
    match_turned(deviations * sigma_rad);
    if (!confirmed_by_wheels(step.match) || step.match.pairs <= most_pairs) continue;
    most_pairs = step.match.pairs;
    best_rad = deviations * sigma_rad;
  }
  match_turned(best_rad.value_or(0));
  return best_rad.has_value();
}

/// Matches from the prediction; where the match is not confirmed, from the found pose, which itself is used
/// if the reference does not confirm it.
void ScanOdometry::match(const PlanarScan& scan, const MotionPrediction& prediction, OdometryStep& step) {
  const auto match_from = [&](const PredictedPose& pose) { step.match = match_once(scan, pose); };
  if (!prediction.find || !prediction.find_first) {
    match_from(predicted());
    move_along_walls(scan, prediction, step);
    if (step.match.ok() && !prediction.find) return track(step);
    // Along a corridor the prediction counts: there must be one.
    const bool is_sure = step.match.free.count == 0 || prediction.T_last_now || prediction.velocity_base ||
                         !velocity_.velocity().isZero();
    if (fits(step.match) && agrees_with_wheels(step.match) &&
        (!prediction.confirms || (is_sure && step.match.mean_error_m <= params_.kFindMaxError_m &&
                                  prediction.confirms(scan, matched_pose(step.match)))))
      return track(step);
  }
  if (!prediction.find) return lose(scan, step);
  step.searched = true;
  const auto found = prediction.find(scan, predicted());
  if (found) step.guessed_m = 0, step.length_observed = true;
  if (!prediction.find_first && !(found && found->sure) && match_as_wheels(scan, step)) return track(step);
  if (found) {
    match_from({found->T_odom_base});
    if (!fits(step.match)) return adopt(scan, *found, step);
    return stays_near(found->T_odom_base, step.match) ? track(step) : adopt(scan, *found, step);
  }
  if (prediction.find_first) {
    match_from(predicted());
    if (match_as_wheels(scan, step)) return track(step);
  }
  accept_unconfirmed(scan, prediction, step);
}

bool ScanOdometry::only_velocity_predicts(const MotionPrediction& prediction) const {
  return !prediction.T_last_now && !prediction.velocity_base && !velocity_.velocity().isZero() &&
         unmatched_s_ <= params_.kMaxGap_s;
}

/// Standard deviation of the motion along walls from what the velocity predicts.
double ScanOdometry::along_sigma_m() const {
  const double time_s = velocity_.since_s(unmatched_s_);
  return std::clamp(kHalfAcceleration_m_s2 * time_s * time_s, kLeastAlong_m, kMostAlong_m);
}

/// Where few pairs or none hold the motion along walls, and only the velocity predicts it, moves the match
/// along them to where the last scans show it.
void ScanOdometry::move_along_walls(const PlanarScan& scan, const MotionPrediction& prediction,
                                    OdometryStep& step) {
  const bool is_free = step.match.free.count == 1;
  const FreeDirections& along = is_free ? step.match.free : step.match.weak;
  const bool may_move = only_velocity_predicts(prediction) && fits(step.match) &&
                        step.match.free.count <= 1 && along.count > 0 &&
                        along.directions[0].head<2>().norm() >= kAlong;
  if (may_move && is_free) return move_freely(scan, prediction, along.directions[0].head<2>(), step);
  along_variance_m2_ = 0;
  const bool is_held = fits(step.match) && step.match.free.count == 0;
  along_observed_ = is_held || prediction.T_last_now || prediction.velocity_base;
  step.length_observed = along_observed_ || step.match.free.count == 0;
  if (may_move && prediction.find_along && velocity_.is_due(unmatched_s_))
    undo_weak_shift(scan, prediction, along.directions[0].head<2>(), step);
}

/// No pair holds the motion along walls: its variance is that of a filter, prediction and search in turn.
void ScanOdometry::move_freely(const PlanarScan& scan, const MotionPrediction& prediction, const Vec2& along,
                               OdometryStep& step) {
  const Vec2 direction = along.normalized();
  const double sigma_m = along_sigma_m();
  double variance_m2 = along_variance_m2_ + sigma_m * sigma_m;
  if (velocity_.is_due(unmatched_s_)) {
    const Vec2 direction_odom = T_odom_keyframe_.rotation() * direction;
    std::optional<FoundShift> found;
    if (prediction.find_along)
      found = prediction.find_along(scan, matched_pose(step.match), direction_odom, sigma_m);
    along_observed_ = found && found->sigma_m <= kMostObserved_m &&
                      shift_match(scan, found->shift_m * direction_odom, 0, step);
    if (along_observed_) variance_m2 /= 1 + variance_m2 / (found->sigma_m * found->sigma_m);
    along_variance_m2_ = variance_m2;
  }
  step.length_observed = along_observed_;
  if (!along_observed_) step.guessed_m = observed_speed_m_s_ * unmatched_s_;
  if (!prediction.find_along) return;
  Mat3 elsewhere = kFreeDirectionVariance_m2 * Mat3::Identity();
  elsewhere.topLeftCorner<2, 2>() +=
      (variance_m2 - kFreeDirectionVariance_m2) * direction * direction.transpose();
  step.match.covariance = fused_covariance(step.match.covariance, elsewhere);
}

/// Moves a match that few pairs shifted along walls back to where the velocity predicts it, if the last scans
/// show it there: reveals of other doors hold a place as firmly as right ones, and would slow the vehicle
/// down until it stands.
void ScanOdometry::undo_weak_shift(const PlanarScan& scan, const MotionPrediction& prediction,
                                   const Vec2& along, OdometryStep& step) {
  const Vec2 direction = along.normalized(), direction_odom = T_odom_keyframe_.rotation() * direction;
  const SE2 T_odom_base = matched_pose(step.match), T_odom_predicted = velocity_.predicted(unmatched_s_);
  const double moved_m = direction_odom.dot(T_odom_base.translation() - T_odom_predicted.translation());
  if (std::abs(moved_m) < kWeakShift_m) return;
  const SE2 T_odom_before(T_odom_base.translation() - moved_m * direction_odom, T_odom_base.angle());
  const auto found = prediction.find_along(scan, T_odom_before, direction_odom, along_sigma_m());
  if (!found || found->sigma_m > kMostObserved_m ||
      std::abs(found->shift_m) > kMostOfWeakShift * std::abs(moved_m))
    return;
  Mat3 covariance = step.match.covariance;
  if (!shift_match(scan, (found->shift_m - moved_m) * direction_odom, PlIcp::kFirmShare, step)) return;
  covariance.topLeftCorner<2, 2>() += found->sigma_m * found->sigma_m * direction * direction.transpose();
  step.match.covariance = covariance;
}

/// Matches from the shifted pose: true if it fits there. Else the match is as it was.
bool ScanOdometry::shift_match(const PlanarScan& scan, const Vec2& shift_odom_m, double least_share,
                               OdometryStep& step) {
  const SE2 T_odom_base = matched_pose(step.match);
  const SE2 T_odom_shifted(T_odom_base.translation() + shift_odom_m, T_odom_base.angle());
  step.match = match_once(scan, {T_odom_shifted}, least_share);
  if (fits(step.match) && stays_near(T_odom_shifted, step.match)) return true;
  step.match = match_once(scan, predicted());  // the matcher's last match is to be the one that counts
  return false;
}

SE2 ScanOdometry::matched_pose(const ScanMatch& match) const {
  return T_odom_keyframe_ * *match.T_reference_sensed;
}

bool ScanOdometry::stays_near(const SE2& T_odom_base, const ScanMatch& match) const {
  const SE2 change = T_odom_base.inverse() * matched_pose(match);
  return change.translation().norm() <= params_.kFoundMaxShift_m &&
         std::abs(change.angle()) <= params_.kFoundMaxTurn_rad;
}

/// Neither the last scans nor the reference confirm a pose: odometry counts, or else the match, but as
/// uncertain.
void ScanOdometry::accept_unconfirmed(const PlanarScan& scan, const MotionPrediction& prediction,
                                      OdometryStep& step) {
  step.confirmed = !prediction.confirms;
  if (prediction.confirms && prediction.T_last_now) {
    const double sigma_m = kUnsureShift_m + kUnsureRatio * matched_.predicted.translation().norm();
    const double sigma_rad = kUnsureTurn_rad + kUnsureRatio * std::abs(matched_.predicted.angle());
    const Vec3 variances(sigma_m * sigma_m, sigma_m * sigma_m, sigma_rad * sigma_rad);
    step.wheel_covariance.reset();  // perhaps they slipped
    return adopt(scan, {step.T_odom_base_predicted, variances.asDiagonal()}, step);
  }
  if (!step.match.ok()) return lose(scan, step);
  const Vec3 unsure(kUnsure_m * kUnsure_m, kUnsure_m * kUnsure_m, kUnsure_rad * kUnsure_rad);
  if (prediction.confirms && only_velocity_predicts(prediction) && accelerates_too_much(step))
    return adopt(scan, {step.T_odom_base_predicted, unsure.asDiagonal()}, step);
  if (prediction.confirms) step.match.covariance.diagonal() += unsure;
  track(step);
}

/// Whether a match lies further from the prediction than a vehicle accelerates.
bool ScanOdometry::accelerates_too_much(const OdometryStep& step) const {
  const Vec2 shift_m = matched_pose(step.match).translation() - step.T_odom_base_predicted.translation();
  return shift_m.norm() > kUnsureShift_m + kMostHalfAcceleration_m_s2 * unmatched_s_ * unmatched_s_;
}

bool ScanOdometry::fits(const ScanMatch& match) const {
  return match.ok() && static_cast<double>(match.pairs) >=
                           params_.kFindMinPairsRatio * static_cast<double>(match.sensed_points);
}

/// Sets the pose of this scan: updates the velocity and resets the failure count.
void ScanOdometry::conclude(const SE2& T_odom_base) {
  T_odom_base_ = T_odom_base;
  matched_ = {T_odom_base_, since_keyframe_};
  if (unmatched_s_ > params_.kMaxGap_s)
    velocity_.reset(T_odom_base_);
  else
    velocity_.update(T_odom_base_, unmatched_s_);
  unmatched_s_ = 0;
  failures_ = 0;
}

void ScanOdometry::adopt(const PlanarScan& scan, const FoundPose& found, OdometryStep& step) {
  judge_wheels(found.T_odom_base, step);
  conclude(found.T_odom_base);
  step.status = OdometryStatus::kFound;
  step.T_odom_base = T_odom_base_;
  step.T_keyframe_base = T_odom_keyframe_.inverse() * T_odom_base_;
  step.match.covariance = turned_covariance(T_odom_keyframe_.rotation().transpose(), found.covariance);
  step.covariance = compose_covariance(T_odom_keyframe_, keyframe_covariance_, *step.T_keyframe_base,
                                       step.match.covariance);
  matcher_.set_reference(scan);
  begin_keyframe(step);
  begin_motion();
}

void ScanOdometry::track(OdometryStep& step) {
  const SE2 T_keyframe_base = *step.match.T_reference_sensed;
  step.status = OdometryStatus::kTracking;
  step.T_odom_base = T_odom_keyframe_ * T_keyframe_base;
  step.T_keyframe_base = T_keyframe_base;
  judge_wheels(*step.T_odom_base, step);
  learn_wheels(step);
  since_keyframe_ = turned_covariance(T_odom_keyframe_.rotation(), step.match.covariance);
  const auto by_wheels = predicted().covariance;
  if (step.wheel_covariance && by_wheels && params_.matcher.compute_covariance)
    since_keyframe_ = (since_keyframe_.inverse() + by_wheels->inverse()).inverse();
  conclude(*step.T_odom_base);
  hold(step.match);
  step.covariance =
      compose_covariance(T_odom_keyframe_, keyframe_covariance_, T_keyframe_base, step.match.covariance);
  if (along_observed_) observed_speed_m_s_ = velocity_.velocity().head<2>().norm();
  if (!wants_keyframe(step.match)) {
    if (params_.reference_scans > 1) matcher_.improve_reference(params_.reference_scans);
    return;
  }
  matcher_.advance_reference(params_.reference_scans);
  begin_keyframe(step);
}

void ScanOdometry::begin_keyframe(OdometryStep& step) {
  T_odom_keyframe_ = T_odom_base_;
  keyframe_covariance_ = step.covariance;
  since_keyframe_.setZero();
  matched_ = held_ = {T_odom_base_, since_keyframe_};
  learned_.covariance.setZero();
  along_variance_m2_ = 0;
  ++keyframes_;
  step.new_keyframe = true;
}

bool ScanOdometry::wants_keyframe(const ScanMatch& match) const {
  if (!params_.use_keyframes) return true;
  const SE2& T_keyframe_base = *match.T_reference_sensed;
  return T_keyframe_base.translation().norm() > params_.keyframe_distance_m ||
         std::abs(T_keyframe_base.angle()) > params_.keyframe_angle_rad ||
         static_cast<double>(match.pairs) <
             params_.keyframe_min_pairs_ratio * static_cast<double>(match.sensed_points);
}

/// Handles a failed match: the reference is kept until too many scans have failed; then the trajectory
/// continues from the predicted pose.
void ScanOdometry::lose(const PlanarScan& scan, OdometryStep& step) {
  step.status = OdometryStatus::kMatchFailed;
  step.guessed_m = 0;
  if (++failures_ < params_.max_failures || scan.size() < static_cast<std::size_t>(params_.matcher.kMinPairs))
    return;
  T_odom_base_ = step.T_odom_base_predicted;
  matcher_.set_reference(scan);
  velocity_.reset(T_odom_base_);
  unmatched_s_ = 0;
  failures_ = 0;
  step.status = OdometryStatus::kRestarted;
  step.confirmed = false;
  step.T_odom_base = T_odom_base_;
  step.covariance = keyframe_covariance_;
  step.covariance.diagonal().array() += kFreeDirectionVariance_m2;
  begin_keyframe(step);
  begin_motion();
}

}  // namespace hm
