#include "hm/odometry/tracker/tracker_attempt.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace hm {
namespace {

constexpr double kMinInlierRatio = 0.2,
                 kFewInliersRatio = 0.3;  // of the matches; fewer may be consistent by chance
constexpr double kFewFoundRatio = 0.3;    // of the landmarks searched for
constexpr int kMinForSecondLook = 6;      // fewer do not determine the pose
constexpr double kWideShift_px = 16;
constexpr std::size_t kFewLandmarks = 60;  // looked for: most of the view is new, or blank
// Chosen with people drawn into TUM fr1/xyz; 0.7 and 1 lead to the same poses as 0.5, and take longer.
constexpr double kContestedRatio = 0.5;  // of the landmarks searched for
constexpr int kEnoughSightings = 5;      // of a landmark
constexpr double kClearlyMore = 1.15;
// Few landmarks are sufficient if the surfaces constrain the camera by themselves and agree.
constexpr int kMinWithSurface = 6;
constexpr double kAgree_m = 0.05, kAgree_rad = 0.03;

bool agree(const SE3& a, const SE3& b) {
  const SE3 difference = a.inverse() * b;
  return difference.translation().norm() < kAgree_m && difference.angle() < kAgree_rad;
}

Attempt look_from(const LocalMap& map, const TrackerFrame& frame, const SE3& T_odom_guess,
                  const PinholeCamera& camera, const AttemptParams& params) {
  Attempt attempt;
  attempt.matches = match_landmarks(map, frame, T_odom_guess, camera, params.matching, attempt.looked_for);
  attempt.registration =
      register_frame(map, frame, attempt.matches, T_odom_guess, camera, params.registration);
  return attempt;
}

/// Whether less than this share of the landmarks searched for agree with the pose.
bool fewer_agree(const Attempt& attempt, double ratio) {
  return attempt.registration.inliers < ratio * static_cast<double>(attempt.looked_for.size());
}

/// Sightings of the landmarks that agree with the pose.
int sightings_of(const LocalMap& map, const Attempt& attempt) {
  int sum = 0;
  for (const LandmarkMatch& match : attempt.matches)
    if (match.inlier) sum += std::min(map.landmark(match.landmark).sightings, kEnoughSightings);
  return sum;
}

bool is_better_known(const LocalMap& map, const Attempt& next, const Attempt& attempt) {
  return sightings_of(map, next) > kClearlyMore * sightings_of(map, attempt);
}

std::string refusal_of(const Attempt& attempt, const AttemptParams& params) {
  const double matches = static_cast<double>(attempt.matches.size());
  const int needed = std::max(params.min_inliers, static_cast<int>(kMinInlierRatio * matches));
  if (attempt.registration.inliers < needed)
    return fmt::format("{} of {} matches agree, {} needed; {} landmarks looked for",
                       attempt.registration.inliers, attempt.matches.size(), needed,
                       attempt.looked_for.size());
  const double sigma_m = position_sigma_m(attempt.registration);
  if (!(sigma_m < params.max_sigma_m))
    return fmt::format("position uncertain by {:.3f} m, {:.3f} m allowed ({} inliers)", sigma_m,
                       params.max_sigma_m, attempt.registration.inliers);
  return {};
}

}  // namespace

AttemptParams::AttemptParams(const OdometryParams& params)
    : min_inliers(params.tracker.kMinInliers), max_sigma_m(params.tracker.kLostSigma_m) {
  matching.limit = static_cast<std::size_t>(params.tracker.kTargetLandmarks);
  matching.max_depth_m = params.max_depth_m;
  matching.max_depth_sigma_m = params.max_depth_sigma_m;
  matching.noise = registration.noise = params.features.depth_noise;
  matching.pixel_sigma_px = params.tracker.kPixelSigma_px;
  registration.surface_weight_ratio = params.tracker.surface_weight_ratio;
}

AttemptParams AttemptParams::widened() const {
  AttemptParams wide = *this;
  wide.matching.search.first_level = 2;
  wide.matching.search.max_shift_px = kWideShift_px;
  return wide;
}

AttemptParams AttemptParams::for_blur() const {
  AttemptParams coarse = *this;
  coarse.matching.search.first_level = 3;
  coarse.matching.search.last_level = 1;
  coarse.matching.search.max_shift_px = kWideShift_px;
  return coarse;
}

namespace {

Attempt attempt_at_scale(const LocalMap& map, const TrackerFrame& frame, const SE3& T_odom_guess,
                         const PinholeCamera& camera, const AttemptParams& params) {
  Attempt attempt = look_from(map, frame, T_odom_guess, camera, params);
  if (attempt.registration.inliers >= kMinForSecondLook && fewer_agree(attempt, kFewFoundRatio)) {
    Attempt again = look_from(map, frame, attempt.registration.T_odom_camera, camera, params);
    if (again.registration.inliers > attempt.registration.inliers) attempt = std::move(again);
  }
  if (attempt.registration.inliers < kFewInliersRatio * static_cast<double>(attempt.matches.size())) {
    // With blur or a wrong camera calibration, a coarse pose is better than none.
    RegistrationParams tolerant = params.registration;
    tolerant.adapt_variance = true;
    attempt.registration = register_frame(map, frame, attempt.matches, T_odom_guess, camera, tolerant);
  }
  attempt.refusal = refusal_of(attempt, params);
  return attempt;
}

}  // namespace

Attempt attempt_pose(const LocalMap& map, const TrackerFrame& frame, const SE3& T_odom_guess,
                     const PinholeCamera& camera, const AttemptParams& params) {
  Attempt attempt = attempt_at_scale(map, frame, T_odom_guess, camera, params);
  if (attempt.refusal.empty()) return attempt;
  Attempt coarse = attempt_at_scale(map, frame, T_odom_guess, camera, params.for_blur());
  return coarse.refusal.empty() ? coarse : attempt;
}

void attempt_again(const LocalMap& map, const TrackerFrame& frame, const SE3& T_odom_guess,
                   const PinholeCamera& camera, const AttemptParams& params, Attempt& attempt) {
  const bool is_refused = !attempt.refusal.empty();
  if (!is_refused && !fewer_agree(attempt, kContestedRatio)) return;
  Attempt next = attempt_pose(map, frame, T_odom_guess, camera, is_refused ? params.widened() : params);
  if (next.refusal.empty() && (is_refused || is_better_known(map, next, attempt))) attempt = std::move(next);
}

std::optional<Attempt> attempt_by_motions(const LocalMap& map, const TrackerFrame& frame,
                                          const SE3& T_odom_last, std::span<const SurfaceMotion> motions,
                                          const PinholeCamera& camera, const AttemptParams& params) {
  for (const SurfaceMotion& motion : motions) {
    const SE3 T_guess = T_odom_last * motion.T_ref_cur;
    AttemptParams wide = params.widened();
    if (motion.held) wide.min_inliers = std::min(wide.min_inliers, kMinWithSurface);
    Attempt next = attempt_pose(map, frame, T_guess, camera, wide);
    if (next.refusal.empty() &&
        (next.registration.inliers >= params.min_inliers || agree(next.registration.T_odom_camera, T_guess)))
      return next;
  }
  return std::nullopt;
}

bool is_enough_with_prior(const Attempt& attempt) {
  if (attempt.looked_for.size() < kFewLandmarks) return attempt.registration.inliers >= kMinWithSurface;
  return attempt.refusal.empty();
}

void note(const Attempt& attempt, TrackingNumbers& numbers) {
  numbers.features = static_cast<int>(attempt.looked_for.size());
  numbers.matches = static_cast<int>(attempt.matches.size());
  numbers.inliers = attempt.registration.inliers;
  numbers.features_with_depth = count_with_depth(attempt.matches);
}

Mat6 covariance_of(const LocalMap& map, const Attempt& attempt) {
  Mat6 of_model = Mat6::Zero();
  double inliers = 0;
  for (const LandmarkMatch& match : attempt.matches) {
    if (!match.inlier) continue;
    of_model += map.find(map.landmark(match.landmark).anchor)->covariance;
    inliers += 1;
  }
  if (inliers == 0) of_model = map.keyframes().back().covariance;  // bridged from there
  return covariance_in_odom(attempt.registration) + of_model / std::max(1.0, inliers);
}

}  // namespace hm
