#include "hm/tsdf/dense_alignment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "hm/core/check.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/tsdf/alignment_pairs.hpp"
#include "hm/tsdf/alignment_search.hpp"

namespace hm {
namespace {

/// Readings needed for an answer.
constexpr std::size_t kFewestReadings = 100;
/// Poses farther out than this (metres) are taken for garbage.
constexpr double kFarthestPose_m = 1e5;
/// Besides the noise, poses are this uncertain in the first round: the robust function then ends where the
/// distance is saturated.
constexpr double kFirstRoundSigma_voxel = 0.6, kFirstRoundSigmas = 2.5;
/// With fewer readings than this near a surface, surfaces are sought along the rays.
constexpr double kSearchBelow_ratio = 0.75;
/// A step this small ends a round: metres, and radians times the readings' typical distance.
constexpr double kSmallestStep_m = 5e-5;

}  // namespace

std::string_view to_string(AlignmentStatus status) {
  constexpr std::array<std::string_view, 5> names{"accepted", "unusable", "too little overlap",
                                                  "too little geometry", "rejected"};
  return names[static_cast<std::size_t>(status)];
}

AlignmentPrior prior_of_given_pose(const AlignmentParams& params, const SE3& T_world_camera) {
  Vec6 information;
  information << Vec3::Constant(std::pow(params.prior_shift_sigma_m, -2)),
      Vec3::Constant(std::pow(params.prior_turn_sigma_rad, -2));
  const Mat6 from_origin = TurningCentre{T_world_camera.translation(), 1}.to_origin().inverse();
  return {T_world_camera, from_origin.transpose() * information.asDiagonal() * from_origin};
}

struct DenseAligner::Impl {
  Impl(const AlignmentParams& alignment, const TsdfParams& its_tsdf, const DepthNoise& noise,
       const PinholeCamera& its_camera)
      : params(alignment),
        tsdf(its_tsdf),
        camera(its_camera),
        sampler(alignment, its_tsdf, noise, its_camera) {}

  AlignmentParams params;
  TsdfParams tsdf;
  PinholeCamera camera;
  AlignmentSampler sampler;
  AlignmentPoints points;
};

namespace {

/// One call of align(): the scan, the map, and how far it is.
class Alignment {
 public:
  Alignment(const AlignmentParams& params, const TsdfParams& tsdf, const VolumeGrid& grid,
            AlignmentPoints& points, const AlignmentPrior& prior)
      : params_(params), tsdf_(tsdf), grid_(grid), points_(points), lookup_(grid), prior_(prior) {
    place_centre();
  }

  void run(AlignmentResult& result);

 private:
  void place_centre();
  /// Sets where the robust function ends: so many standard deviations, which are larger than the noise asks
  /// for by `extra_sigma_m` (as root of the sum of squares).
  void set_widths(double sigmas, double extra_sigma_m);
  [[nodiscard]] AlignmentTerms terms_at(const SE3& pose, std::size_t count);
  [[nodiscard]] AlignmentFit fit_of(const AlignmentTerms& terms, std::size_t count) const;
  [[nodiscard]] Observability seen_at(const SE3& pose);
  [[nodiscard]] Observability observability_of(const AlignmentTerms& terms) const;
  /// What geometry and prior know together, `from_prior` away from the prior.
  [[nodiscard]] Information with_prior(const Information& geometry, const Observability& seen,
                                       const Vec6& from_prior) const;
  /// Information of one sum of weights: readings near to each other count as one.
  [[nodiscard]] double information_scale(std::size_t round) const;
  [[nodiscard]] double objective(const AlignmentTerms& terms, const SE3& pose, double scale) const;
  /// Seeks surfaces along the rays when the prior is too far off for gradients.
  [[nodiscard]] SE3 search_from(const SE3& start, int& iterations);
  [[nodiscard]] SE3 refine(SE3 pose, std::size_t round, int& iterations);
  void judge(AlignmentResult& result) const;
  void describe(std::size_t round, AlignmentResult& result);

  const AlignmentParams& params_;
  const TsdfParams& tsdf_;
  const VolumeGrid& grid_;
  AlignmentPoints& points_;
  VoxelLookup lookup_;
  const AlignmentPrior& prior_;
  TurningCentre centre_;
  Mat6 prior_information_ = Mat6::Zero();  ///< about the centre
  double width_sigmas_ = 1;                ///< see set_widths()
};

void Alignment::place_centre() {
  const std::size_t count = points_.round_end.front();
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < count; ++i) sum += Vec3(points_.x_m[i], points_.y_m[i], points_.z_m[i]);
  const Vec3 centroid = sum / static_cast<double>(count);
  double square_m2 = 0;
  for (std::size_t i = 0; i < count; ++i)
    square_m2 += (Vec3(points_.x_m[i], points_.y_m[i], points_.z_m[i]) - centroid).squaredNorm();
  centre_.p_world = prior_.T_world_camera * centroid;
  centre_.arm_m = std::max(std::sqrt(square_m2 / static_cast<double>(count)), 1e-2);
  // Where nobody knows anything of a direction, the camera's own position and orientation stay: a metre, a
  // radian.
  AlignmentParams weak;
  weak.prior_shift_sigma_m = weak.prior_turn_sigma_rad = 1;
  const Mat6 at_origin = prior_.information + prior_of_given_pose(weak, prior_.T_world_camera).information;
  prior_information_ = centre_.to_origin().transpose() * at_origin * centre_.to_origin();
}

void Alignment::set_widths(double sigmas, double extra_sigma_m) {
  width_sigmas_ = sigmas;
  const auto extra_m2 = static_cast<float>(extra_sigma_m * extra_sigma_m);
  const auto factor = static_cast<float>(sigmas);
  for (std::size_t i = 0; i < points_.size(); ++i)
    points_.inverse_width[i] = 1.0f / (factor * std::sqrt(points_.variance_m2[i] + extra_m2 + 1e-12f));
}

AlignmentTerms Alignment::terms_at(const SE3& pose, std::size_t count) {
  const AlignmentView view(pose, centre_.p_world, grid_, tsdf_.distance_limit_m());
  return sum_alignment_terms(view, count, lookup_, points_);
}

AlignmentFit Alignment::fit_of(const AlignmentTerms& terms, std::size_t count) const {
  const auto all = static_cast<double>(count);
  AlignmentFit fit;
  fit.cost = terms.cost / all;
  fit.overlap_ratio = terms.on_map / all;
  fit.inlier_ratio = terms.on_map > 0 ? terms.agreeing / terms.on_map : 0.0;
  if (terms.agreeing > 0) {
    fit.rms_m = std::sqrt(terms.square_m2 / terms.agreeing);
    fit.rms_sigmas = width_sigmas_ * std::sqrt(terms.square_width / terms.agreeing);
  }
  return fit;
}

Observability Alignment::observability_of(const AlignmentTerms& terms) const {
  return observability(terms.H, terms.weight, centre_.arm_m, params_.min_observability_ratio);
}

double Alignment::information_scale(std::size_t round) const {
  const double stride_px =
      static_cast<double>(std::max(params_.coarsest_stride_px, params_.finest_stride_px)) /
      static_cast<double>(std::size_t{1} << round);
  const double share = std::min(1.0, stride_px / params_.independent_px);
  // The terms are in units of the robust function's width.
  return share * share * width_sigmas_ * width_sigmas_;
}

double Alignment::objective(const AlignmentTerms& terms, const SE3& pose, double scale) const {
  const Vec6 from_prior = centre_.between(prior_.T_world_camera, pose);
  return scale / 6.0 * terms.cost + 0.5 * from_prior.dot(prior_information_ * from_prior);
}

SE3 Alignment::search_from(const SE3& start, int& iterations) {
  SurfaceSearch search;
  search.reach_m = params_.search_voxel * grid_.voxel_size_m();
  search.near_surface_m = 0.75 * tsdf_.distance_limit_m();
  search.width_m = 2.0 * search.near_surface_m;
  search.count = points_.round_end.front();
  search.every = std::max<std::size_t>(1, search.count / 1200);
  SE3 pose = start;
  for (int i = 0; i < params_.max_iterations; ++i, ++iterations) {
    const AlignmentTerms terms = sum_search_terms(search, points_, {pose, centre_.p_world}, lookup_);
    const double scale = 1.0 / (search.width_m * search.width_m);
    const Vec6 from_prior = centre_.between(prior_.T_world_camera, pose);
    Vec6 step = damped_step(
        with_prior({scale * terms.H, scale * terms.b}, observability_of(terms), from_prior), 1e-3);
    pose = centre_.moved(pose, step);
    step.tail<3>() *= centre_.arm_m;
    if (step.norm() < 0.02 * grid_.voxel_size_m()) break;
  }
  return pose;
}

SE3 Alignment::refine(SE3 pose, std::size_t round, int& iterations) {
  const std::size_t count = points_.round_end[round];
  const double scale = information_scale(round);
  AlignmentTerms terms = terms_at(pose, count);
  Observability seen = seen_at(pose);
  double value = objective(terms, pose, scale), damping = 0;
  for (int i = 0; i < params_.max_iterations; ++i) {
    const Vec6 from_prior = centre_.between(prior_.T_world_camera, pose);
    Vec6 step = damped_step(with_prior({scale * terms.H, scale * terms.b}, seen, from_prior), damping);
    const SE3 moved = centre_.moved(pose, step);
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
  return pose;
}

Observability Alignment::seen_at(const SE3& pose) {
  const AlignmentView view(pose, centre_.p_world, grid_, tsdf_.distance_limit_m());
  const PairTerms pairs = sum_pair_terms(view, points_.round_end.front(), points_);
  return observability(pairs.H, pairs.weight, centre_.arm_m, params_.min_observability_ratio);
}

void Alignment::run(AlignmentResult& result) {
  const std::size_t first = points_.round_end.front(), last = points_.round_end.size() - 1;
  SE3 pose = prior_.T_world_camera;
  set_widths(params_.inlier_sigmas_ratio, 0);
  result.before = fit_of(terms_at(pose, first), first);
  const double first_sigma_m = kFirstRoundSigma_voxel * grid_.voxel_size_m();
  set_widths(kFirstRoundSigmas, first_sigma_m);
  const AlignmentTerms wide = terms_at(pose, first);
  if (wide.on_map < kSearchBelow_ratio * static_cast<double>(first) && params_.search_voxel > 0) {
    result.searched = true;
    const SE3 found = search_from(pose, result.iterations);
    if (terms_at(found, first).cost < wide.cost) pose = found;
  }
  pose = refine(pose, 0, result.iterations);
  for (std::size_t round = last > 0 ? 1 : 0; round <= last; ++round) {
    const bool final_round = round == last;
    set_widths(params_.robust_sigmas_ratio,
               final_round ? 0 : first_sigma_m * std::pow(0.3, static_cast<double>(round)));
    pose = refine(pose, round, result.iterations);
  }
  result.T_world_found = pose;
  describe(last, result);
  set_widths(params_.inlier_sigmas_ratio, 0);
  result.after = fit_of(terms_at(pose, first), first);
  judge(result);
}

Information Alignment::with_prior(const Information& geometry, const Observability& seen,
                                  const Vec6& from_prior) const {
  Information information = observable_part(geometry, seen, centre_.arm_m);
  information.H += prior_information_;
  information.b += prior_information_ * from_prior;
  return information;
}

void Alignment::describe(std::size_t round, AlignmentResult& result) {
  const AlignmentTerms terms = terms_at(result.T_world_found, points_.round_end[round]);
  const Observability seen = seen_at(result.T_world_found);
  result.observability = seen.share;
  result.directions = seen.directions;
  result.unobservable_directions = seen.unobservable;
  result.readings = points_.round_end[round];
  const double scale = information_scale(round);
  result.covariance =
      covariance_at_origin(with_prior({scale * terms.H, Vec6::Zero()}, seen, Vec6::Zero()).H, centre_);
}

void Alignment::judge(AlignmentResult& result) const {
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
  } else if (shift_m > params_.max_shift_m || turn_rad > params_.max_turn_rad) {
    result.reason = fmt::format("a correction of {:.3f} m and {:.3f} rad is not believed", shift_m, turn_rad);
  } else {
    result.status = AlignmentStatus::kAccepted;
    result.T_world_camera = result.T_world_found;
  }
}

/// Why a scan cannot be aligned whatever the map holds, or nothing.
std::string unusable_because(const DepthImage& depth, const PinholeCamera& camera,
                             const AlignmentPrior& prior) {
  if (!is_rigid(prior.T_world_camera)) return "the prior pose is not a finite rigid motion";
  if (prior.T_world_camera.translation().cwiseAbs().maxCoeff() > kFarthestPose_m)
    return fmt::format("the prior pose is {:.3g} m from the origin",
                       prior.T_world_camera.translation().norm());
  if (!prior.information.allFinite()) return "the prior's information is not finite";
  if (depth.width() != camera.width || depth.height() != camera.height)
    return fmt::format("the depth image is {} x {}, the camera {} x {}", depth.width(), depth.height(),
                       camera.width, camera.height);
  if (!(depth.unit_m > 0)) return fmt::format("the depth unit is {} m", depth.unit_m);
  return {};
}

}  // namespace

DenseAligner::DenseAligner(const AlignmentParams& params, const TsdfParams& tsdf, const DepthNoise& noise,
                           const PinholeCamera& camera)
    : impl_(std::make_unique<Impl>(params, tsdf, noise, camera)) {
  HM_CHECK(camera.distortion.is_zero(), "the camera still has lens distortion");
}
DenseAligner::~DenseAligner() = default;
DenseAligner::DenseAligner(DenseAligner&&) noexcept = default;
DenseAligner& DenseAligner::operator=(DenseAligner&&) noexcept = default;

AlignmentResult DenseAligner::align(const VolumeGrid& grid, const DepthImage& depth,
                                    const AlignmentPrior& prior) {
  HM_CHECK(grid.voxel_size_m() == impl_->tsdf.voxel_size_m, "voxels of {} m, parameters for {} m",
           grid.voxel_size_m(), impl_->tsdf.voxel_size_m);
  const Stopwatch watch;
  AlignmentResult result;
  result.T_world_camera = result.T_world_found = prior.T_world_camera;
  result.reason = unusable_because(depth, impl_->camera, prior);
  if (!result.reason.empty()) return result;
  impl_->sampler.choose(depth, impl_->points);
  if (const std::size_t readings = impl_->points.round_end.front(); readings < kFewestReadings)
    result.reason = fmt::format("{} usable readings; {} are needed", readings, kFewestReadings);
  else
    Alignment(impl_->params, impl_->tsdf, grid, impl_->points, prior).run(result);
  result.milliseconds = watch.milliseconds();
  return result;
}

}  // namespace hm
