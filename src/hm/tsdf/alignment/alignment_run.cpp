#include "hm/tsdf/alignment/alignment_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hm/geometry/solvers/small_solvers.hpp"
#include "hm/tsdf/alignment/alignment_pairs.hpp"
#include "hm/tsdf/alignment/alignment_search.hpp"

namespace hm {
namespace {

/// Pose uncertainty in the first round, in addition to the noise: the robust function then ends where the
/// distance is saturated.
constexpr double kFirstRoundSigma_voxel = 0.6, kFirstRoundSigmas = 2.5;
/// With a smaller share of readings near a surface, surfaces are searched for along the rays.
constexpr double kSearchBelow_ratio = 0.75, kFullyOnMap_ratio = 0.95;
/// Distance along a free axis over which the map is compared with itself, and limits of tilting the axis
/// (radians).
constexpr double kStraightenReach_m = 0.5, kMostTilt = 0.1, kLeastTilt = 2e-5;
constexpr int kStraightenPasses = 8;
/// Convergence limit of a round: metres, and radians times the readings' typical distance.
constexpr double kSmallestStep_m = 5e-5;

}  // namespace

void AlignmentRun::place_centre() {
  const std::size_t count = points_.round_end.front();
  Vec3 sum = Vec3::Zero();
  double square_m2 = 0, weights = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 p(points_.x_m[i], points_.y_m[i], points_.z_m[i]);
    const double weight = 1.0 / static_cast<double>(points_.variance_m2[i]);
    sum += weight * p, square_m2 += weight * p.squaredNorm(), weights += weight;
  }
  const Vec3 centroid = sum / weights;
  centre_.p_world = prior_.T_world_camera * centroid;
  centre_.arm_m = std::max(std::sqrt(std::max(square_m2 / weights - centroid.squaredNorm(), 0.0)), 1e-2);
  // Weak prior for directions without information: a metre, a radian.
  AlignmentParams weak;
  weak.prior_shift_sigma_m = weak.prior_turn_sigma_rad = 1;
  const Mat6 at_origin = prior_.information + prior_of_given_pose(weak, prior_.T_world_camera).information;
  prior_information_ = centre_.to_origin().transpose() * at_origin * centre_.to_origin();
}

void AlignmentRun::set_widths(double sigmas, double extra_sigma_m) {
  width_sigmas_ = sigmas;
  const auto extra_m2 = static_cast<float>(extra_sigma_m * extra_sigma_m);
  const auto factor = static_cast<float>(sigmas);
  for (std::size_t i = 0; i < points_.size(); ++i)
    points_.inverse_width[i] = 1.0f / (factor * std::sqrt(points_.variance_m2[i] + extra_m2 + 1e-12f));
}

AlignmentTerms AlignmentRun::terms_at(const SE3& pose, std::size_t count) {
  const AlignmentView view(pose, centre_.p_world, grid_, tsdf_.distance_limit_m());
  return sum_alignment_terms(view, count, lookup_, points_);
}

AlignmentFit AlignmentRun::fit_of(const AlignmentTerms& terms, std::size_t count) const {
  const auto all = static_cast<double>(count);
  AlignmentFit fit;
  fit.cost = terms.cost / all;
  fit.overlap_ratio = terms.on_map / all;
  fit.inlier_ratio = terms.on_map > 0 ? terms.agreeing / terms.on_map : 0.0;
  if (terms.agreeing > 0) fit.rms_m = std::sqrt(terms.square_m2 / terms.agreeing);
  return fit;
}

Observability AlignmentRun::observability_of(const AlignmentTerms& terms) const {
  return observability(terms.H, terms.weight, centre_.arm_m, params_.kMinObservabilityRatio);
}

double AlignmentRun::information_scale(std::size_t round) const {
  const double stride_px =
      static_cast<double>(std::max(params_.kCoarsestStride_px, params_.kFinestStride_px)) /
      static_cast<double>(std::size_t{1} << round);
  const double share = std::min(1.0, stride_px / params_.kIndependent_px);
  // The terms are in units of the robust function's width.
  return share * share * width_sigmas_ * width_sigmas_;
}

double AlignmentRun::objective(const AlignmentTerms& terms, const SE3& pose, double scale) const {
  const Vec6 from_prior = centre_.between(prior_.T_world_camera, pose);
  return scale / 6.0 * terms.cost + 0.5 * from_prior.dot(prior_information_ * from_prior);
}

SE3 AlignmentRun::search_from(const SE3& start, int& iterations) {
  SurfaceSearch search;
  search.reach_m = params_.search_voxel * grid_.voxel_size_m();
  search.near_surface_m = kNearSurface_ratio * tsdf_.distance_limit_m();
  search.width_m = 2.0 * search.near_surface_m;
  search.count = points_.round_end.front();
  search.every = std::max<std::size_t>(1, search.count / 1200);
  SE3 pose = start;
  for (int i = 0; i < params_.max_iterations; ++i, ++iterations) {
    const AlignmentTerms terms = sum_search_terms(search, points_, {pose, centre_.p_world}, lookup_);
    const double scale = 1.0 / (search.width_m * search.width_m);
    const Vec6 from_prior = centre_.between(prior_.T_world_camera, pose);
    const Observability seen = observability_of(terms);
    Vec6 step = damped_step(with_prior({scale * terms.H, scale * terms.b}, seen, from_prior), 1e-3);
    pose = seen.held(centre_.moved(pose, step), prior_.T_world_camera);
    step.tail<3>() *= centre_.arm_m;
    if (step.norm() < 0.02 * grid_.voxel_size_m()) break;
  }
  return pose;
}

AlignmentRun::Refined AlignmentRun::refine(SE3 pose, std::size_t round, int& iterations) {
  const std::size_t count = points_.round_end[round];
  const double scale = information_scale(round);
  AlignmentTerms terms = terms_at(pose, count);
  Observability seen = seen_at(pose);
  double value = objective(terms, pose, scale), damping = 0;
  for (int i = 0; i < params_.max_iterations; ++i) {
    const Vec6 from_prior = centre_.between(prior_.T_world_camera, pose);
    Vec6 step = damped_step(with_prior({scale * terms.H, scale * terms.b}, seen, from_prior), damping);
    const SE3 moved = seen.held(centre_.moved(pose, step), prior_.T_world_camera);
    step.tail<3>() *= centre_.arm_m;
    if (!(step.norm() >= kSmallestStep_m)) break;
    ++iterations;
    const AlignmentTerms moved_terms = terms_at(moved, count);
    const double moved_value = objective(moved_terms, moved, scale);
    if (moved_value < value) {
      pose = moved, terms = moved_terms, value = moved_value;
      if (step.norm() > 0.1 * grid_.voxel_size_m()) seen = seen_at(pose);  // more readings agree now
      damping = damping < 1e-3 ? 0 : damping / 10;
    } else if (damping > 10) {
      break;
    } else {
      damping = damping == 0 ? 0.1 : damping * 10;
    }
  }
  return {pose, terms, seen};
}

Observability AlignmentRun::seen_at(const SE3& pose) {
  const AlignmentView view(pose, centre_.p_world, grid_, tsdf_.distance_limit_m());
  const PairTerms pairs = sum_pair_terms(view, points_.round_end.front(), points_);
  return observability(pairs.H, pairs.weight, centre_.arm_m, params_.kMinObservabilityRatio);
}

Vec3 AlignmentRun::tilt_of(const Vec3& axis, const Mat3& across, const SE3& pose) {
  const double near_m = kNearSurface_ratio * tsdf_.distance_limit_m();
  Mat3 H = Mat3::Zero();
  Vec3 b = Vec3::Zero();
  for (std::size_t i = 0; i < points_.round_end.front(); ++i) {
    const Vec3 p = pose * Vec3(points_.x_m[i], points_.y_m[i], points_.z_m[i]);
    const auto here = lookup_.sample(p);
    if (!here || std::abs(here->distance_m) > near_m) continue;
    const double slope = here->gradient.norm();
    for (const double reach_m : {-kStraightenReach_m, kStraightenReach_m}) {
      const auto there = lookup_.sample(p + reach_m * axis);
      if (!there || std::abs(there->distance_m) > near_m) continue;
      const double its_slope = there->gradient.norm();
      if (!(there->gradient.dot(here->gradient) > 0.7 * slope * its_slope)) continue;  // another surface
      const Vec3 normal = there->gradient / its_slope;
      const double weight = reach_m / static_cast<double>(points_.variance_m2[i]);
      H += weight * reach_m * normal * normal.transpose();
      b += weight * (there->distance_m / its_slope - here->distance_m / slope) * normal;
    }
  }
  H = across * H * across;
  H.diagonal().array() += 1e-6 * H.trace() + 1e-9;
  return -(across * solve_symmetric_3(H, across * b));
}

void AlignmentRun::straighten(const SE3& pose, Observability& seen) {
  Mat3 across = Mat3::Identity();
  for (int i = 0; i < seen.free_shifts; ++i)
    across -= seen.directions.col(i).head<3>() * seen.directions.col(i).head<3>().transpose();
  for (int i = 0; i < seen.free_shifts; ++i) {
    Vec3 axis = seen.directions.col(i).head<3>();
    double scale = 1, last = kMostTilt;
    for (int pass = 0; pass < kStraightenPasses; ++pass) {
      const Vec3 tilt = tilt_of(axis, across, pose);
      const double size = tilt.norm();
      if (!(size < kMostTilt) || size < kLeastTilt) break;
      if (size > 0.5 * last) scale *= 0.5;  // it overshoots
      axis = (axis + scale * tilt).normalized();
      last = size;
    }
    seen.directions.col(i).head<3>() = axis;
  }
}

void AlignmentRun::run(AlignmentResult& result) {
  const std::size_t first = points_.round_end.front(), last = points_.round_end.size() - 1;
  SE3 pose = prior_.T_world_camera;
  set_widths(params_.kInlierSigmasRatio, 0);
  result.before = fit_of(terms_at(pose, first), first);
  const double first_sigma_m = kFirstRoundSigma_voxel * grid_.voxel_size_m();
  set_widths(kFirstRoundSigmas, first_sigma_m);
  AlignmentTerms wide = terms_at(pose, first);
  if (prior_.T_world_start) {
    const AlignmentTerms from_start = terms_at(*prior_.T_world_start, first);
    if (from_start.cost < wide.cost) pose = *prior_.T_world_start, wide = from_start;
  }
  // Also if part of the image is out of reach, which may make a direction unobservable.
  const double on_map_ratio = wide.on_map / static_cast<double>(first);
  const bool part_is_off = on_map_ratio < kFullyOnMap_ratio && seen_at(pose).unobservable > 0;
  if ((on_map_ratio < kSearchBelow_ratio || part_is_off) && params_.search_voxel > 0) {
    result.searched = true;
    const SE3 found = search_from(pose, result.iterations);
    if (terms_at(found, first).cost < wide.cost) pose = found;
  }
  Refined refined = refine(pose, 0, result.iterations);
  for (std::size_t round = last > 0 ? 1 : 0; round <= last; ++round) {
    const bool final_round = round == last;
    set_widths(params_.kRobustSigmasRatio,
               final_round ? 0 : first_sigma_m * std::pow(0.3, static_cast<double>(round)));
    refined = refine(refined.pose, round, result.iterations);
  }
  result.T_world_found = weighed(refined, last);
  describe(last, result);
  set_widths(params_.kInlierSigmasRatio, 0);
  result.after = fit_of(terms_at(result.T_world_found, first), first);
  judge(result);
}

Information AlignmentRun::with_prior(const Information& geometry, const Observability& seen,
                                     const Vec6& from_prior) const {
  Information information = observable_part(geometry, seen, centre_.arm_m);
  information.H += prior_information_;
  information.b += prior_information_ * from_prior;
  return information;
}

Mat6 AlignmentRun::information_share(const Mat6& geometry) const {
  const double sigma_m = params_.shared_sigma_voxel * grid_.voxel_size_m();
  if (sigma_m <= 0) return Mat6::Identity();
  Vec6 precision = Vec6::Constant(1.0 / (sigma_m * sigma_m));
  precision.tail<3>() *= centre_.arm_m * centre_.arm_m;
  const Mat6 limit = precision.asDiagonal();
  return limit * inverse_of(geometry + limit);
}

SE3 AlignmentRun::weighed(const Refined& refined, std::size_t round) const {
  const auto& [pose, terms, seen] = refined;
  if (params_.shared_sigma_voxel <= 0) return pose;
  const double scale = information_scale(round);
  const Mat6 geometry = observable_part({scale * terms.H}, seen, centre_.arm_m).H;
  const Mat6 share = information_share(geometry);
  const Vec6 of_scan = (geometry + prior_information_) * centre_.between(prior_.T_world_camera, pose);
  const Mat6 together = share * geometry + prior_information_;
  const Vec6 step = solve_symmetric(together, share * of_scan);
  return seen.held(centre_.moved(prior_.T_world_camera, step), prior_.T_world_camera);
}

void AlignmentRun::describe(std::size_t round, AlignmentResult& result) {
  const AlignmentTerms terms = terms_at(result.T_world_found, points_.round_end[round]);
  Observability seen = seen_at(result.T_world_found);
  straighten(result.T_world_found, seen);
  result.T_world_found = seen.held(result.T_world_found, prior_.T_world_camera);
  result.observability = seen.share;
  result.directions = seen.directions;
  result.unobservable_directions = seen.unobservable;
  result.readings = points_.round_end[round];
  const double scale = information_scale(round);
  const Mat6 geometry = observable_part({scale * terms.H}, seen, centre_.arm_m).H;
  result.covariance =
      covariance_at_origin(information_share(geometry) * geometry + prior_information_, centre_);
}

void AlignmentRun::judge(AlignmentResult& result) const {
  const Vec6 correction = centre_.between(prior_.T_world_camera, result.T_world_found);
  const double shift_m = (result.T_world_found.translation() - prior_.T_world_camera.translation()).norm();
  const double turn_rad = correction.tail<3>().norm();
  const AlignmentFit& after = result.after;
  result.status = AlignmentStatus::kRejected;
  if (after.overlap_ratio < params_.min_overlap_ratio) {
    result.status = AlignmentStatus::kTooLittleOverlap;
    result.reason = fmt::format("{:.0f} % of the readings lie on the map; {:.0f} % are needed",
                                after.overlap_ratio * 100, params_.min_overlap_ratio * 100);
  } else if (result.unobservable_directions == 6) {
    result.status = AlignmentStatus::kTooLittleGeometry;
    result.reason = "no direction of motion is seen";
  } else if (after.inlier_ratio < params_.min_inlier_ratio) {
    result.reason = fmt::format("{:.0f} % of the readings on the map agree with it; {:.0f} % are needed",
                                after.inlier_ratio * 100, params_.min_inlier_ratio * 100);
  } else if (after.cost > result.before.cost) {
    result.reason = fmt::format("it explains the scan worse than before: mean cost {:.4f} after {:.4f}",
                                after.cost, result.before.cost);
  } else if (shift_m > params_.kMaxTranslation_m || turn_rad > params_.kMaxRotation_rad) {
    result.reason =
        fmt::format("a correction of {:.3f} m and {:.3f} rad exceeds the limits", shift_m, turn_rad);
  } else {
    result.status = AlignmentStatus::kAccepted;
    result.T_world_camera = result.T_world_found;
  }
}

}  // namespace hm
