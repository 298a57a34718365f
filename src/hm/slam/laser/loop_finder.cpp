#include "hm/slam/laser/loop_finder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "hm/geometry/planar_covariance.hpp"

namespace hm {
namespace {

/// Least share of a scan's points in the area that the submap observed, and most of what both show that may
/// contradict.
constexpr double kMinObservedRatio = 0.4, kMaxContradictedInSubmap = 0.08;
/// A match with a single scan is taken in place of that with the whole submap up to this deviation, and from
/// this share of points on that both scans show.
constexpr double kExact_m = 0.02, kShared = 0.5;
/// Deviation of a match in a direction that nothing holds; no larger, as that direction is known to
/// milliradians only: 100 m would blur by decimetres what is held.
constexpr double kFreeSigma_m = 5;
/// So far a match is moved to see how much it turns on the way; by less a metre it does so by noise.
constexpr double kAlong_m = 1, kLeastTurn_rad_m = 0.015;
/// Both matches must agree by so much: only that with the submap was checked for contradictions.
constexpr double kSamePlace_m = 0.1, kSamePlace_rad = 0.03;
/// From this share on the graph's uncertainty is too small, and a search that finds nothing goes on in a
/// window so much wider.
constexpr double kContradictedForWider = 0.25, kWider = 2;

/// A window so much wider, within the limits of all windows; nothing where it is at all of them.
std::optional<SearchWindow> widened(const SearchWindow& window, double factor,
                                    const ScanGraph2DParams& params) {
  SearchWindow wider = window;
  wider.half_x_m = std::min(factor * window.half_x_m, params.max_window_m);
  wider.half_y_m = std::min(factor * window.half_y_m, params.max_window_m);
  wider.half_angle_rad = std::min(factor * window.half_angle_rad, params.kMaxWindow_rad);
  const bool grew = wider.half_x_m > window.half_x_m || wider.half_y_m > window.half_y_m ||
                    wider.half_angle_rad > window.half_angle_rad;
  return grew ? std::optional(wider) : std::nullopt;
}

/// Direction in which a covariance is largest.
Vec2 weakest_direction(const Mat2& covariance) {
  const double angle = 0.5 * std::atan2(2 * covariance(0, 1), covariance(0, 0) - covariance(1, 1));
  return {std::cos(angle), std::sin(angle)};
}

/// Whether a scan shows much of what a map observed on both sides of the line through the base along an axis
/// of the map: a single straight wall is like any other.
bool walls_on_both_sides(const PlanarScan& scan, const ObservedArea& seen, const SE2& T_map_base,
                         const Vec2& axis) {
  constexpr double kBeside_m = 0.3, kLeastRatio = 0.15;
  const Vec2 across = axis.unitOrthogonal();
  const auto beside = [&](double side) {
    return std::ranges::count_if(scan.points_m, [&](const Vec2& point) {
      return side * across.dot(T_map_base.rotation() * point) > kBeside_m &&
             seen.contains(T_map_base * point);
    });
  };
  return static_cast<double>(std::min(beside(1), beside(-1))) >
         kLeastRatio * static_cast<double>(scan.size());
}

/// Covariance of a place that the search found: no other one fits nearly as well, also where PL-ICP finds few
/// lines, as among trees and pillars. Its deviations are a quarter of what the search takes for the same
/// place; those of an edge are twice as large.
Mat3 covariance_of_found(const CorrelativeSearchParams& search) {
  return Vec3(search.other_place_m, search.other_place_m, search.other_angle_rad).cwiseAbs2().asDiagonal() *
         (1.0 / 16);
}

/// Whether PL-ICP ends near its guess, with small errors, and pairs most of the points that it could.
bool confirms(const ScanMatch& match, const SE2& guess, double points, const ScanGraph2DParams& params) {
  const SE2 correction = guess.inverse() * *match.T_reference_sensed;
  return correction.translation().norm() <= params.kVerifyMaxTranslation_m &&
         std::abs(correction.angle()) <= params.kVerifyMaxRotation_rad &&
         match.mean_error_m <= params.kVerifyMaxError_m &&
         static_cast<double>(match.pairs) >= params.kVerifyMinPairsRatio * points;
}

LoopOutcome outcome_of(CorrelativeStatus status) {
  switch (status) {
    case CorrelativeStatus::kAmbiguous:
      return LoopOutcome::kAmbiguous;
    case CorrelativeStatus::kLimitReached:
      return LoopOutcome::kLimitReached;
    case CorrelativeStatus::kFound:
    case CorrelativeStatus::kNothing:
      break;
  }
  return LoopOutcome::kNoMatch;
}

}  // namespace

std::string_view to_string(LoopOutcome outcome) {
  switch (outcome) {
    case LoopOutcome::kAccepted:
      return "accepted";
    case LoopOutcome::kNoMatch:
      return "no match";
    case LoopOutcome::kAmbiguous:
      return "ambiguous";
    case LoopOutcome::kLimitReached:
      return "search limit reached";
    case LoopOutcome::kNotVerified:
      return "not verified";
    case LoopOutcome::kAlone:
      return "no other loop agrees";
  }
  return "";
}

bool confirms_shared(const ScanMatch& match, const SE2& guess, const ScanGraph2DParams& params) {
  return confirms(match, guess, kShared * static_cast<double>(match.sensed_points), params);
}

double apart_m(const SE2& motion) {
  constexpr double kApartPerTurn_m = 0.7;
  return motion.translation().norm() + kApartPerTurn_m * std::abs(motion.angle());
}

LoopFinder::LoopFinder(const ScanGraph2DParams& params)
    : params_(params), rasters_(params), matcher_(params.matcher) {}

FoundLoop LoopFinder::find(const MappedKeyframes& path, const ScanSubmap& submap, const SearchWindow& window,
                           bool may_widen) {
  FoundLoop result{LoopOutcome::kNoMatch, 0, window, {}};
  std::vector<Vec2> points_m = points_within(path.keyframes.back().scan, params_.kMaxPointRange_m,
                                             static_cast<std::size_t>(params_.kMaxSearchPoints));
  if (points_m.size() < static_cast<std::size_t>(params_.kMinPoints) / 2) return result;
  const SubmapRasters::Raster& raster = rasters_.raster(submap, path.keyframes);
  Search search{path, submap, raster.map, std::move(points_m), window, {}};
  search.params.min_score = params_.min_score;
  search.params.ambiguity_ratio = params_.ambiguity_ratio;
  // With repetitions at a distance p, a wrong match in the window implies p <= 2 windows, so that another
  // repetition lies within three windows. Along a curve this holds for repetitions that turn by up to 0.3
  // rad.
  search.params.other_window_ratio = 3;
  CorrelativeMatch match = search_correlative(search.map, search.points_m, search.window, search.params);
  const auto wider = widened(search.window, kWider, params_);
  if (match.status == CorrelativeStatus::kNothing && may_widen && wider &&
      contradicted_on_way(path, submap.anchor()) > kContradictedForWider) {
    result.window = search.window = *wider;
    match = search_correlative(search.map, search.points_m, search.window, search.params);
  }
  result.score = match.score;
  result.outcome = outcome_of(match.status);
  if (match.status == CorrelativeStatus::kFound) {
    result.match = verified(search, match.T_map_scan);
    if (!result.match)
      result.outcome = LoopOutcome::kNotVerified;
    else
      result.match->covariance =
          fused_covariance(result.match->covariance, covariance_of_found(search.params));
  } else if (match.status == CorrelativeStatus::kAmbiguous) {
    result.match = verified_along_walls(search, match);
  }
  return result;
}

/// The match in a corridor, where poses along it fit as well: the one nearest to the graph's estimate, with
/// the direction along the walls left free. Nothing if poses beside that line fit too.
std::optional<LoopMatch> LoopFinder::verified_along_walls(const Search& search,
                                                          const CorrelativeMatch& ambiguous) {
  const auto& [keyframes, T_map] = search.path;
  const auto best = verified(search, ambiguous.T_map_scan);
  if (!best) return std::nullopt;
  const SE2 T_anchor_from =
      keyframes[search.submap.anchor()].T_odom_base.inverse() * keyframes[best->from].T_odom_base;
  CorrelativeSearchParams params = search.params;
  params.free_axis = T_anchor_from.rotation() * weakest_direction(best->covariance.topLeftCorner<2, 2>());
  if (!walls_on_both_sides(keyframes.back().scan, *search.map.seen(), ambiguous.T_map_scan,
                           *params.free_axis))
    return std::nullopt;
  if (search_correlative(search.map, search.points_m, search.window, params).status !=
      CorrelativeStatus::kFound)
    return std::nullopt;
  const Vec2 offset = search.window.centre.translation() - ambiguous.T_map_scan.translation();
  const Vec2 nearest = ambiguous.T_map_scan.translation() + params.free_axis->dot(offset) * *params.free_axis;
  auto match = verified(search, {nearest.x(), nearest.y(), ambiguous.T_map_scan.angle()});
  if (!match) return std::nullopt;
  // A direction that PL-ICP left free is the same one, and added to it would blur what the walls hold.
  if (is_free(match->covariance)) return match;
  const SE2 T_from_anchor =
      keyframes[match->from].T_odom_base.inverse() * keyframes[search.submap.anchor()].T_odom_base;
  const Vec2 axis = T_from_anchor.rotation() * *params.free_axis;
  match->covariance.topLeftCorner<2, 2>() += kFreeSigma_m * kFreeSigma_m * axis * axis.transpose();
  return match;
}

/// Motion (x, y, angle) of a scan per metre along an axis, where it fits all along: in a straight corridor it
/// does not turn, in a round one by its curvature.
Vec3 LoopFinder::free_motion(const PlanarScan& reference, const PlanarScan& scan, const SE2& T_reference_scan,
                             const Vec2& axis) {
  const Vec3 straight(axis.x(), axis.y(), 0);
  std::array<SE2, 2> moved;
  for (const int side : {0, 1}) {
    const Vec2 shift_m = (2 * side - 1) * kAlong_m * axis;
    const ScanMatch match = matcher_.match(
        reference, scan, SE2(T_reference_scan.translation() + shift_m, T_reference_scan.angle()));
    if (!match.ok()) return straight;
    moved[static_cast<std::size_t>(side)] = *match.T_reference_sensed;
  }
  const Vec2 motion_m = moved[1].translation() - moved[0].translation();
  const double along_m = axis.dot(motion_m), turn_rad = wrap_angle(moved[1].angle() - moved[0].angle());
  if (along_m < kAlong_m) return straight;
  const bool turns = std::abs(turn_rad) > kLeastTurn_rad_m * along_m;
  return Vec3(motion_m.x(), motion_m.y(), turns ? turn_rad : 0) / along_m;
}

/// The covariance of a match with deviations of at most kFreeSigma_m in the directions that nothing holds.
/// How much these turn is measured: in PL-ICP's covariance it is noise of the normals, with which the graph
/// would pay for headings, which are held, by ways along the walls, which are not.
Mat3 LoopFinder::with_free_sigma(const ScanMatch& match, const PlanarScan& reference,
                                 const PlanarScan& scan) {
  Mat3 covariance = match.covariance;
  const Vec2 weakest = weakest_direction(covariance.topLeftCorner<2, 2>());
  for (const Vec2& axis : {weakest, Vec2(weakest.unitOrthogonal())}) {
    const Vec3 along = covariance.leftCols<2>() * axis;
    const double variance = axis.dot(along.head<2>());
    if (variance <= kFree_m * kFree_m) break;
    const Vec3 free = free_motion(reference, scan, *match.T_reference_sensed, axis);
    covariance += std::min(variance, kFreeSigma_m * kFreeSigma_m) * free * free.transpose() -
                  along * along.transpose() / variance;
  }
  return covariance;
}

/// Pose of the last keyframe relative to the submap's nearest one, if PL-ICP confirms the search's match
/// with what the submap's scans together show there, and if nothing of it contradicts them.
std::optional<LoopMatch> LoopFinder::verified(const Search& search, const SE2& T_anchor_base) {
  const std::span<const GraphKeyframe2D> keyframes = search.path.keyframes;
  const ScanSubmap& submap = search.submap;
  const ObservedArea& seen = *search.map.seen();
  const PlanarScan& scan = keyframes.back().scan;
  const SE2 T_odom_anchor = keyframes[submap.anchor()].T_odom_base;
  const SE2 T_odom_guess = T_odom_anchor * T_anchor_base;
  const PlanarScan together = submap_scan(submap, keyframes, T_odom_guess, scan.origin_m);
  const ScanMatch match = matcher_.match(together, scan, SE2());
  if (!match.ok()) return std::nullopt;
  const SE2& correction = *match.T_reference_sensed;
  const SE2 T_odom_base = T_odom_guess * correction, T_anchor_matched = T_anchor_base * correction;
  // Pairs were observed, also where beams are too far apart for the area between them to count.
  const auto observed = static_cast<double>(std::max<std::ptrdiff_t>(
      static_cast<std::ptrdiff_t>(match.pairs), std::ranges::count_if(scan.points_m, [&](const Vec2& point) {
        return seen.contains(T_anchor_matched * point);
      })));
  if (!confirms(match, SE2(), observed, params_) ||
      observed < kMinObservedRatio * static_cast<double>(scan.size()))
    return std::nullopt;
  ScanAgreement agreement;
  std::size_t nearest = submap.first;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = submap.first; k < submap.end; ++k) {
    const SE2 T_k_base = keyframes[k].T_odom_base.inverse() * T_odom_base;
    compare_scans(keyframes[k].scan, scan, T_k_base, kVisitLimits, agreement);
    if (apart_m(T_k_base) >= least) continue;
    least = apart_m(T_k_base);
    nearest = k;
  }
  if (agreement.contradicted_ratio() > kMaxContradictedInSubmap) return std::nullopt;
  const SE2 T_nearest_base = keyframes[nearest].T_odom_base.inverse() * T_odom_base;
  // A single scan that determines the place is more exact than all of the submap with its drift.
  const ScanMatch direct = matcher_.match(keyframes[nearest].scan, scan, T_nearest_base);
  const SE2 moved = direct.ok() ? T_nearest_base.inverse() * *direct.T_reference_sensed : SE2();
  if (direct.ok() && confirms_shared(direct, T_nearest_base, params_) &&
      moved.translation().norm() < kSamePlace_m && std::abs(moved.angle()) < kSamePlace_rad &&
      direct.covariance.topLeftCorner<2, 2>().trace() < kExact_m * kExact_m)
    return LoopMatch{nearest, *direct.T_reference_sensed, direct.covariance};
  const Mat3 rotated = turned_covariance((T_nearest_base * correction.inverse()).rotation(),
                                         with_free_sigma(match, together, scan));
  return LoopMatch{nearest, T_nearest_base, rotated};
}

}  // namespace hm
