#include "hm/slam/laser/motion_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hm/slam/laser/correlative_search.hpp"
#include "hm/slam/laser/scan_submaps.hpp"

namespace hm {
namespace {

constexpr double kResolution_m = 0.05;
constexpr int kLevels = 6;
constexpr double kLeastTime_s = 0.25;  // shorter times do not increase the penalty further
/// Rotation by one radian reduces the overlap of two scans like a translation by this distance.
constexpr double kSearchApartPerTurn_m = 0.7;

}  // namespace

MotionSearch::MotionSearch(const MotionSearchParams& params, const PlIcpParams& matcher)
    : params_(params), matcher_(matcher) {}

void MotionSearch::clear() {
  keyframes_.clear();
  raster_.reset();
  failures_ = 0;
}

void MotionSearch::add(const PlanarScan& scan, const SE2& T_odom_base) {
  if (scan.size() < static_cast<std::size_t>(params_.kMinPoints)) return;
  if (!keyframes_.empty()) {
    const SE2 motion = keyframes_.back().T_odom_base.inverse() * T_odom_base;
    if (motion.translation().norm() < params_.keyframe_distance_m &&
        std::abs(motion.angle()) < params_.keyframe_angle_rad)
      return;
  }
  if (keyframes_.size() >= static_cast<std::size_t>(params_.keyframes)) keyframes_.pop_front();
  keyframes_.push_back({scan, T_odom_base});
  raster_.reset();
}

const CorrelativeMap& MotionSearch::raster() {
  if (raster_) return *raster_;
  std::vector<Vec2> points_m;
  for (const Keyframe& keyframe : keyframes_)
    for (const Vec2& point : points_within(keyframe.scan, params_.kMaxPointRange_m,
                                           static_cast<std::size_t>(4 * params_.kMaxPoints)))
      points_m.push_back(keyframe.T_odom_base * point);
  raster_.emplace(points_m, CorrelativeMapParams{kResolution_m, params_.sigma_m, kLevels});
  return *raster_;
}

std::optional<FoundScan> MotionSearch::find(const PlanarScan& scan, const SE2& T_odom_base_predicted,
                                            double elapsed_s) {
  const std::vector<Vec2> points_m =
      points_within(scan, params_.kMaxPointRange_m, static_cast<std::size_t>(params_.kMaxPoints));
  if (keyframes_.empty() || points_m.size() < static_cast<std::size_t>(params_.kMinPoints))
    return std::nullopt;
  const double half_m = std::min(params_.max_window_m, (1 + failures_) * params_.window_m);
  CorrelativeSearchParams search;
  search.min_score = params_.min_score;
  search.ambiguity_ratio = 1;
  const double time_s = std::max(kLeastTime_s, elapsed_s);
  search.shift_penalty_per_m2 = params_.kShiftPenaltyS2PerM2 / (time_s * time_s);
  search.turn_penalty_per_rad2 = params_.kTurnPenaltyS2PerRad2 / (time_s * time_s);
  const CorrelativeMatch match = search_correlative(
      raster(), points_m, {T_odom_base_predicted, half_m, half_m, params_.kWindow_rad}, search);
  ++failures_;
  if (match.status != CorrelativeStatus::kFound && match.status != CorrelativeStatus::kAmbiguous)
    return std::nullopt;
  auto found = confirmed(scan, match.T_map_scan);
  if (!found) return std::nullopt;
  failures_ = 0;
  found->score = match.score;
  return found;
}

std::optional<FoundScan> MotionSearch::confirmed(const PlanarScan& scan, const SE2& T_odom_base) {
  const Keyframe* nearest = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const Keyframe& keyframe : keyframes_) {
    const SE2 T = keyframe.T_odom_base.inverse() * T_odom_base;
    const double apart = T.translation().norm() + kSearchApartPerTurn_m * std::abs(T.angle());
    if (apart < least) least = apart, nearest = &keyframe;
  }
  const ScanMatch match = matcher_.match(nearest->scan, scan, nearest->T_odom_base.inverse() * T_odom_base);
  if (!match.ok() || match.mean_error_m > params_.max_error_m ||
      static_cast<double>(match.pairs) < params_.min_pairs_ratio * static_cast<double>(match.sensed_points))
    return std::nullopt;
  Mat3 turn = Mat3::Identity();
  turn.topLeftCorner<2, 2>() = nearest->T_odom_base.rotation();
  return FoundScan{nearest->T_odom_base * *match.T_reference_sensed,
                   turn * match.covariance * turn.transpose(), 0};
}

}  // namespace hm
