#include "hm/slam/laser/motion/motion_search.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "hm/geometry/planar_covariance.hpp"
#include "hm/slam/laser/scan_submaps.hpp"
#include "hm/slam/laser/search/correlative_search.hpp"

namespace hm {
namespace {

constexpr double kResolution_m = 0.1, kAngleStep_rad = 0.02;
constexpr int kLevels = 6;
/// Each sector of headings has a best place of its own.
constexpr double kSector_rad = 0.26;
/// Places that score less than this share of the best one are not looked at.
constexpr double kMinScoreRatio = 0.6;
constexpr std::size_t kMaxPlaces = 8;
/// The window grows so fast with the time since the last pose.
constexpr double kWander_m_s = 0.2;
constexpr double kLeastTime_s = 0.25;  // shorter times do not increase the penalty further
/// Rotation by one radian reduces the overlap of two scans like a translation by this distance.
constexpr double kSearchApartPerTurn_m = 0.7;
/// PL-ICP must not leave the place that the search found.
constexpr double kMaxRefinement_m = 0.3, kMaxRefinement_rad = 0.2;
/// Scans a few tenths of a second apart agree more closely than visits do.
constexpr ScanAgreementLimits kAgreementLimits{0.12, 0.02, 12, 60};
/// A point that was seen through weighs so much more than one that agrees.
constexpr double kSeenThroughWeight = 3;
/// Agreement of few points is worth less: the share of all points that halves it.
constexpr double kPriorRatio = 0.1;
constexpr double kMinAgreement = 0.85;
/// A place needs this merit. It is certain with more, when no other place comes near it.
constexpr double kMinMerit = 0.2, kSureMerit = 0.4, kRivalRatio = 0.75;
constexpr double kOtherPlace_m = 0.4, kOtherPlace_rad = 0.2;
/// Deviations of a place that PL-ICP does not refine, and of one that another place rivals.
constexpr double kCoarse_m = 0.1, kCoarse_rad = 0.05, kUncertain_m = 0.5, kUncertain_rad = 0.5;
constexpr std::size_t kMinPointsInCommon = 40, kKeyframesToAgree = 6;

/// Penalty for a deviation from a prediction with a covariance, per chi2; it approaches that of this chi2,
/// since wheels slip and their heading may be read late: the walls count more than the wheels.
constexpr double kDeviationPenalty = 0.02, kMostPenalised_chi2 = 9;
/// Up to this chi2 a place and the prediction agree.
constexpr double kAgreement_chi2 = 16;
/// Deviations of a place that is right, besides those of the prediction.
constexpr double kPlaceError_m = 0.05, kPlaceError_rad = 0.03;

Mat3 covariance_of(double sigma_m, double sigma_rad) {
  return Vec3(sigma_m * sigma_m, sigma_m * sigma_m, sigma_rad * sigma_rad).asDiagonal();
}

/// Weighs a place with the prediction where they agree: where the place is not determined, as along a
/// corridor, the prediction counts.
void weigh_with(const MotionSearchStart& start, FoundScan& found) {
  Vec3 error = found.T_odom_base.vector() - start.T_odom_base.vector();
  error.z() = wrap_angle(error.z());
  const Mat3 sum_of_both =
      *start.covariance + found.covariance + covariance_of(kPlaceError_m, kPlaceError_rad);
  if (error.dot(sum_of_both.inverse() * error) > kAgreement_chi2) return;
  const Mat3 gain = *start.covariance * (*start.covariance + found.covariance).inverse();
  const Vec3 sum = start.T_odom_base.vector() + gain * error;
  found.T_odom_base = SE2(sum.x(), sum.y(), sum.z());
  found.covariance = gain * found.covariance;
}

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
  if (!keyframes_.is_due(T_odom_base)) return;
  keyframes_.add(T_odom_base, scan);
  raster_.reset();
}

const CorrelativeMap& MotionSearch::raster() {
  if (raster_) return *raster_;
  std::vector<Vec2> points_m;
  for (const auto& keyframe : keyframes_.all())
    for (const Vec2& point : points_within(keyframe.content, params_.kMaxPointRange_m,
                                           static_cast<std::size_t>(4 * params_.kMaxPoints)))
      points_m.push_back(keyframe.T_odom_base * point);
  raster_.emplace(points_m, CorrelativeMapParams{kResolution_m, params_.kSigma_m, kLevels});
  return *raster_;
}

ScanAgreement MotionSearch::agreement(const PlanarScan& scan, const SE2& T_odom_base,
                                      std::size_t max_keyframes) const {
  ScanAgreement sum;
  const auto& keyframes = keyframes_.all();
  const std::size_t step = std::max<std::size_t>(1, (keyframes.size() + max_keyframes - 1) / max_keyframes);
  for (std::size_t i = keyframes.size(); i > 0; i -= std::min(i, step))
    compare_scans(keyframes[i - 1].content, scan, keyframes[i - 1].T_odom_base.inverse() * T_odom_base,
                  kAgreementLimits, sum);
  return sum;
}

bool MotionSearch::agrees(const PlanarScan& scan, const SE2& T_odom_base) const {
  const ScanAgreement sum = agreement(scan, T_odom_base, kKeyframesToAgree);
  return sum.agrees + sum.seen_through < kMinPointsInCommon || 1 - sum.contradicted_ratio() >= kMinAgreement;
}

/// The best place of each sector of headings, best first.
std::vector<MotionSearch::Place> MotionSearch::places(const std::vector<Vec2>& points_m,
                                                      const MotionSearchStart& start) {
  const double half_m =
      std::min(params_.kMaxWindow_m, (1 + failures_) * params_.window_m + kWander_m_s * start.elapsed_s);
  const double half_rad = std::min(start.half_angle_rad, std::numbers::pi);
  const int sectors = std::max(1, static_cast<int>(std::ceil(2 * half_rad / kSector_rad)));
  const double sector_rad = 2 * half_rad / sectors;
  CorrelativeSearchParams search;
  search.min_score = params_.min_score;
  search.ambiguity_ratio = CorrelativeSearchParams::kNoAlternatives;
  search.angle_step_rad = kAngleStep_rad;
  std::vector<Place> found;
  for (int sector = 0; sector < sectors; ++sector) {
    const double turn = (sector + 0.5) * sector_rad - half_rad;
    const SE2 centre(start.T_odom_base.translation(), start.T_odom_base.angle() + turn);
    const CorrelativeMatch match =
        search_correlative(raster(), points_m, {centre, half_m, half_m, sector_rad / 2}, search);
    if (match.status != CorrelativeStatus::kFound) continue;
    found.push_back({match.T_map_scan, match.score});
    search.min_score = std::max(search.min_score, kMinScoreRatio * match.score);
  }
  std::ranges::stable_sort(found, std::ranges::greater{}, &Place::score);
  if (found.size() > kMaxPlaces) found.resize(kMaxPlaces);
  return found;
}

std::optional<FoundScan> MotionSearch::find(const PlanarScan& scan, const MotionSearchStart& start) {
  const std::vector<Vec2> points_m =
      points_within(scan, params_.kMaxPointRange_m, static_cast<std::size_t>(params_.kMaxPoints));
  if (keyframes_.all().empty() || points_m.size() < static_cast<std::size_t>(params_.kMinPoints))
    return std::nullopt;
  std::vector<Place> found = places(points_m, start);
  ++failures_;
  for (Place& place : found) {
    refine(scan, place);
    place.merit = merit(scan, points_m, place.T_odom_base, start);
  }
  const auto best = std::ranges::max_element(found, {}, &Place::merit);
  if (best == found.end() || best->merit < kMinMerit) return std::nullopt;
  failures_ = 0;
  const bool rivalled = std::ranges::any_of(found, [&](const Place& other) {
    const SE2 apart = best->T_odom_base.inverse() * other.T_odom_base;
    return other.merit > kRivalRatio * best->merit &&
           (apart.translation().norm() > kOtherPlace_m || std::abs(apart.angle()) > kOtherPlace_rad);
  });
  FoundScan result{best->T_odom_base, best->covariance, best->score, !rivalled && best->merit >= kSureMerit};
  if (start.covariance) weigh_with(start, result);
  if (!result.sure) result.covariance += covariance_of(kUncertain_m, kUncertain_rad);
  return result;
}

/// How well a scan fits there: its score on the raster times its agreement with the keyframes, less the
/// penalty for the deviation from the prediction.
double MotionSearch::merit(const PlanarScan& scan, const std::vector<Vec2>& points_m, const SE2& T_odom_base,
                           const MotionSearchStart& start) {
  const ScanAgreement sum = agreement(scan, T_odom_base, keyframes_.all().size());
  const auto agrees = static_cast<double>(sum.agrees), through = static_cast<double>(sum.seen_through);
  const double points = static_cast<double>(keyframes_.all().size() * kAgreementLimits.max_points * 2);
  return raster().score(points_m, T_odom_base) * agrees /
             (agrees + kSeenThroughWeight * through + kPriorRatio * points) -
         penalty(start, T_odom_base);
}

/// Penalty of the deviation from the prediction.
double MotionSearch::penalty(const MotionSearchStart& start, const SE2& T_odom_base) const {
  if (start.covariance) {
    const Vec2 shift = T_odom_base.translation() - start.T_odom_base.translation();
    const Vec3 error(shift.x(), shift.y(), wrap_angle(T_odom_base.angle() - start.T_odom_base.angle()));
    const Mat3 covariance = *start.covariance + covariance_of(kPlaceError_m, kPlaceError_rad);
    const double chi2 = error.dot(covariance.inverse() * error);
    return kDeviationPenalty * chi2 / (1 + chi2 / kMostPenalised_chi2);
  }
  const SE2 deviation = start.T_odom_base.inverse() * T_odom_base;
  const double time_s = std::max(kLeastTime_s, start.elapsed_s);
  const double speed_m_s = deviation.translation().norm() / time_s, rate_rad_s = deviation.angle() / time_s;
  return params_.kShiftPenaltyS2PerM2 * speed_m_s * speed_m_s +
         params_.kTurnPenaltyS2PerRad2 * rate_rad_s * rate_rad_s;
}

/// Improves a place by PL-ICP against the nearest keyframe, where that confirms it.
void MotionSearch::refine(const PlanarScan& scan, Place& place) {
  place.covariance = covariance_of(kCoarse_m, kCoarse_rad);
  const Keyframes::Keyframe* nearest = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& keyframe : keyframes_.all()) {
    const SE2 T = keyframe.T_odom_base.inverse() * place.T_odom_base;
    const double apart = T.translation().norm() + kSearchApartPerTurn_m * std::abs(T.angle());
    if (apart < least) least = apart, nearest = &keyframe;
  }
  const ScanMatch match =
      matcher_.match(nearest->content, scan, nearest->T_odom_base.inverse() * place.T_odom_base);
  if (!match.ok() || match.mean_error_m > params_.kMaxError_m ||
      static_cast<double>(match.pairs) < params_.kMinPairsRatio * static_cast<double>(match.sensed_points))
    return;
  const SE2 refined = nearest->T_odom_base * *match.T_reference_sensed;
  const SE2 change = place.T_odom_base.inverse() * refined;
  if (change.translation().norm() > kMaxRefinement_m || std::abs(change.angle()) > kMaxRefinement_rad) return;
  place.T_odom_base = refined;
  place.covariance = turned_covariance(nearest->T_odom_base.rotation(), match.covariance);
}

}  // namespace hm
