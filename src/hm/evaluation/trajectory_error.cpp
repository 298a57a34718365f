#include "hm/evaluation/trajectory_error.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "hm/core/check.hpp"
#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

std::vector<PosePair> associate_nearest(const Trajectory& truth, const Trajectory& estimate,
                                        Duration window) {
  struct Candidate {
    std::int64_t difference_ns;
    std::size_t truth, estimate;
    auto operator<=>(const Candidate&) const = default;
  };
  std::vector<Candidate> candidates;
  for (std::size_t e = 0; e < estimate.size(); ++e) {
    const Time stamp = estimate[e].stamp;
    auto t = std::lower_bound(truth.begin(), truth.end(), stamp - window,
                              [](const StampedPose& pose, Time time) { return pose.stamp < time; });
    for (; t != truth.end() && t->stamp <= stamp + window; ++t)
      candidates.push_back({std::abs((t->stamp - stamp).ns), static_cast<std::size_t>(t - truth.begin()), e});
  }
  std::sort(candidates.begin(), candidates.end());
  std::vector<bool> truth_taken(truth.size()), estimate_taken(estimate.size());
  std::vector<PosePair> pairs;
  for (const Candidate& c : candidates) {
    if (truth_taken[c.truth] || estimate_taken[c.estimate]) continue;
    truth_taken[c.truth] = estimate_taken[c.estimate] = true;
    pairs.push_back({truth[c.truth].stamp, truth[c.truth].T_world_base, estimate[c.estimate].T_world_base});
  }
  std::sort(pairs.begin(), pairs.end(),
            [](const PosePair& a, const PosePair& b) { return a.stamp < b.stamp; });
  return pairs;
}

std::vector<PosePair> associate_interpolated(const Trajectory& truth, const Trajectory& estimate,
                                             Duration max_gap) {
  std::vector<PosePair> pairs;
  for (const StampedPose& pose : estimate)
    if (const std::optional<SE3> there = pose_at(truth, pose.stamp, max_gap))
      pairs.push_back({pose.stamp, *there, pose.T_world_base});
  return pairs;
}

Vec3 mean(std::span<const Vec3> points) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

/// Rotation about z by the angle that maximises the sum of dot products of the horizontal parts.
Mat3 best_yaw(const Mat3& covariance_to_from) {
  const Mat3& c = covariance_to_from;
  const double angle = std::atan2(c(1, 0) - c(0, 1), c(0, 0) + c(1, 1));
  return so3_exp(angle * Vec3::UnitZ());
}

/// The rotation of this kind that maximises the trace of its transpose times `covariance` (to from^T).
Mat3 best_rotation(const Mat3& covariance, TrajectoryAlignment kind) {
  if (kind == TrajectoryAlignment::kNone) return Mat3::Identity();
  if (kind == TrajectoryAlignment::kYaw) return best_yaw(covariance);
  const Svd3 svd = svd_of(covariance);
  Vec3 sign = Vec3::Ones();
  if (svd.U.determinant() * svd.V.determinant() < 0) sign.z() = -1;  // no mirror (Umeyama 1991, eq. 43)
  return svd.U * sign.asDiagonal() * svd.V.transpose();
}

/// TrajectoryError::alignment_uncertainty_rad of aligned pairs with these position errors.
double alignment_uncertainty_rad(std::span<const PosePair> aligned, double position_rmse_m,
                                 TrajectoryAlignment kind) {
  if (kind == TrajectoryAlignment::kNone) return 0;
  const auto n = static_cast<double>(aligned.size());
  Vec3 truth_mean = Vec3::Zero(), estimate_mean = Vec3::Zero();
  for (const PosePair& pair : aligned) {
    truth_mean += pair.T_world_truth.translation() / n;
    estimate_mean += pair.T_world_estimate.translation() / n;
  }
  Mat3 cross = Mat3::Zero();
  for (const PosePair& pair : aligned)
    cross += (pair.T_world_truth.translation() - truth_mean) *
             (pair.T_world_estimate.translation() - estimate_mean).transpose() / n;
  const Mat3 curvature = cross.trace() * Mat3::Identity() - 0.5 * (cross + cross.transpose());
  const double least =
      kind == TrajectoryAlignment::kYaw ? curvature(2, 2) : symmetric_eigenvalues(curvature)[0];
  constexpr double kRounding = 1e-12;
  if (!(least > kRounding * std::abs(cross.trace()))) return std::numeric_limits<double>::infinity();
  return position_rmse_m * std::sqrt(n / (n - 2) / least);
}

Error too_few_pairs(const Trajectory& truth, const Trajectory& estimate, std::size_t pairs,
                    const TrajectoryErrorParams& params) {
  const bool nearest = params.association == TrajectoryAssociation::kNearest;
  const auto span = [](const Trajectory& t) {
    return t.empty() ? std::string("no pose")
                     : fmt::format("{} poses from {:.3f} s to {:.3f} s", t.size(), t.front().stamp.seconds(),
                                   t.back().stamp.seconds());
  };
  double overlap_s = 0;
  if (!truth.empty() && !estimate.empty())
    overlap_s = (std::min(truth.back().stamp, estimate.back().stamp) -
                 std::max(truth.front().stamp, estimate.front().stamp))
                    .seconds();
  std::string advice =
      nearest
          ? "Compare the stamps' clocks, or allow a larger difference "
            "(trajectory_error.max_stamp_difference_s)"
          : "Compare the stamps' clocks, or allow a larger gap (trajectory_error.max_truth_gap_s), or use "
            "the nearest pose (trajectory_error.association=nearest)";
  if (overlap_s < 0) {
    const double later_s = (estimate.front().stamp - truth.front().stamp).seconds();
    advice = fmt::format(
        "The clocks have nothing in common: the estimate begins {:.3f} s {} than the truth. If both begin at "
        "the same moment, add {:.3f} s to the stamps of the estimate",
        std::abs(later_s), later_s > 0 ? "later" : "earlier", -later_s);
  }
  return {ErrorCode::kInvalidValue,
          fmt::format("{} of at least 3 poses match ({} {:g} s): the truth has {}, the estimate has {}; they "
                      "overlap by {:.3f} s. {}",
                      pairs, nearest ? "stamps within" : "between two true poses within",
                      nearest ? params.max_stamp_difference_s : params.max_truth_gap_s, span(truth),
                      span(estimate), std::max(0.0, overlap_s), advice),
          truth.empty()      ? kTrueTrajectory
          : estimate.empty() ? kEstimatedTrajectory
                             : ""};
}

/// Distance along the true path up to each pair, metres.
std::vector<double> distance_travelled(std::span<const PosePair> pairs) {
  std::vector<double> travelled(pairs.size(), 0.0);
  for (std::size_t i = 1; i < pairs.size(); ++i)
    travelled[i] = travelled[i - 1] +
                   (pairs[i].T_world_truth.translation() - pairs[i - 1].T_world_truth.translation()).norm();
  return travelled;
}

/// Coordinate of each pair (frame number, seconds, metres) that never decreases.
std::vector<double> span_coordinate(std::span<const PosePair> pairs, RpeUnit unit) {
  if (unit == RpeUnit::kMetres) return distance_travelled(pairs);
  std::vector<double> coordinate(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i)
    coordinate[i] =
        unit == RpeUnit::kFrames ? static_cast<double>(i) : (pairs[i].stamp - pairs[0].stamp).seconds();
  return coordinate;
}

/// Error when the positions are too close together to determine a scale.
Result<void> check_scale(const std::vector<Vec3>& positions) {
  constexpr double kLeastSpread_m = 1e-6;
  const Vec3 centre = mean(positions);
  double spread_m = 0;
  for (const Vec3& p : positions) spread_m = std::max(spread_m, (p - centre).norm());
  if (spread_m >= kLeastSpread_m) return {};
  return fail(ErrorCode::kInvalidValue, {},
              "the estimate's {} matched poses stay within {:g} m, so its scale cannot be found; align with "
              "se3 instead",
              positions.size(), spread_m);
}

/// Root mean square of the distances between moved and other points.
double fit_rmse_m(const SimilarityTransform& moves, std::span<const Vec3> from, std::span<const Vec3> to) {
  double sum_m2 = 0;
  for (std::size_t i = 0; i < from.size(); ++i) sum_m2 += (moves * from[i] - to[i]).squaredNorm();
  return std::sqrt(sum_m2 / static_cast<double>(from.size()));
}

/// Lengths of the two paths, and the size of one relative to the other.
void add_sizes(TrajectoryError& result, const std::vector<Vec3>& truth, const std::vector<Vec3>& estimate) {
  constexpr double kLeastScale = 1e-9, kOff_ratio = 1.1, kExplained_ratio = 0.5;
  result.truth_path_m = path_length(truth);
  result.estimate_path_m = path_length(estimate);
  if (!check_scale(estimate) || !check_scale(truth)) return;
  const SimilarityTransform similar = align_points(estimate, truth, TrajectoryAlignment::kSim3);
  if (!(similar.scale > kLeastScale)) return;
  result.size_ratio = 1 / similar.scale;
  const SimilarityTransform rigid = align_points(estimate, truth, TrajectoryAlignment::kSe3);
  result.wrong_size =
      std::max(similar.scale, 1 / similar.scale) > kOff_ratio &&
      fit_rmse_m(similar, estimate, truth) < kExplained_ratio * fit_rmse_m(rigid, estimate, truth);
}

/// Applies the alignment to the estimate and computes the absolute errors of its positions.
void add_position_errors(TrajectoryError& result) {
  std::vector<double> given;
  for (PosePair& pair : result.matched) {
    given.push_back((pair.T_world_estimate.translation() - pair.T_world_truth.translation()).norm());
    pair.T_world_estimate = {result.alignment.rotation * pair.T_world_estimate.rotation(),
                             result.alignment * pair.T_world_estimate.translation()};
    result.position_errors_m.push_back(
        (pair.T_world_estimate.translation() - pair.T_world_truth.translation()).norm());
  }
  result.position_m = summarise(result.position_errors_m);
  result.position_given_m = summarise(given);
}

/// Computes the errors of the orientations after both alignments, and whether the first determines them.
void add_rotation_errors(TrajectoryError& result, TrajectoryAlignment kind) {
  Mat3 covariance = Mat3::Zero();
  for (const PosePair& pair : result.matched)
    covariance += pair.T_world_truth.rotation() * pair.T_world_estimate.rotation().transpose();
  const Mat3 R_own_aligned = best_rotation(covariance, kind);
  std::vector<double> errors, own_errors;
  for (const PosePair& pair : result.matched) {
    const SE3 own(R_own_aligned * pair.T_world_estimate.rotation(), Vec3::Zero());
    errors.push_back((pair.T_world_truth.inverse() * pair.T_world_estimate).angle());
    own_errors.push_back((pair.T_world_truth.inverse() * own).angle());
  }
  result.rotation_rad = summarise(errors);
  result.rotation_own_rad = summarise(own_errors);
  result.R_own = R_own_aligned * result.alignment.rotation;
  result.alignment_uncertainty_rad = alignment_uncertainty_rad(result.matched, result.position_m.rmse, kind);
  constexpr double kSmallAngle_rad = 0.5, kMuch_rad = 0.05, kMisleading_ratio = 2;
  const double between_rad = SE3(R_own_aligned, Vec3::Zero()).angle();
  const double uncertainty_rad = result.alignment_uncertainty_rad;
  result.rotation_undetermined =
      uncertainty_rad > kSmallAngle_rad ||
      (uncertainty_rad > kMuch_rad && between_rad <= uncertainty_rad &&
       result.rotation_rad.rmse > kMisleading_ratio * result.rotation_own_rad.rmse);
}

}  // namespace

std::optional<double> rotation_rmse_rad(const TrajectoryError& error) {
  if (error.rotation_undetermined) return std::nullopt;
  return error.rotation_rad.rmse;
}

bool is_of_one_source(const TrajectoryError& error) {
  constexpr double kSame_m = 2e-6, kSame_rad = 1e-5;
  return std::min(error.position_m.median, error.position_given_m.median) < kSame_m &&
         error.rotation_own_rad.median < kSame_rad;
}

std::vector<PosePair> associate(const Trajectory& truth, const Trajectory& estimate,
                                const TrajectoryErrorParams& params) {
  return params.association == TrajectoryAssociation::kNearest
             ? associate_nearest(truth, estimate, Duration::from_seconds(params.max_stamp_difference_s))
             : associate_interpolated(truth, estimate, Duration::from_seconds(params.max_truth_gap_s));
}

SimilarityTransform align_points(std::span<const Vec3> from, std::span<const Vec3> to,
                                 TrajectoryAlignment kind) {
  HM_CHECK(!from.empty() && from.size() == to.size(), "{} and {} points", from.size(), to.size());
  SimilarityTransform result;
  if (kind == TrajectoryAlignment::kNone) return result;
  const Vec3 mean_from = mean(from), mean_to = mean(to);
  Mat3 covariance = Mat3::Zero();
  double variance_from = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    covariance += (to[i] - mean_to) * (from[i] - mean_from).transpose();
    variance_from += (from[i] - mean_from).squaredNorm();
  }
  result.rotation = best_rotation(covariance, kind);
  if (kind == TrajectoryAlignment::kSim3 && variance_from > 0)
    result.scale = (result.rotation.transpose() * covariance).trace() / variance_from;  // eq. 42
  result.translation = mean_to - result.scale * (result.rotation * mean_from);
  return result;
}

RelativeErrors relative_errors(std::span<const PosePair> pairs, RpeUnit unit, double delta) {
  RelativeErrors result{
      unit, unit == RpeUnit::kFrames ? std::max(1.0, std::round(delta)) : delta, {}, {}, {}};
  const std::vector<double> at = span_coordinate(pairs, unit);
  // A gap in the recording is not a span of delta; poses sparser than delta are used as they are.
  std::vector<double> steps, translations, rotations;
  for (std::size_t i = 1; i < at.size(); ++i) steps.push_back(at[i] - at[i - 1]);
  const double longest = std::max(1.5 * result.delta, result.delta + 1.5 * quantile(steps, 0.5));
  for (std::size_t i = 0, j = 0; i < pairs.size(); ++i) {
    j = std::max(j, i + 1);
    while (j < pairs.size() && at[j] - at[i] < result.delta * (1 - 1e-9)) ++j;
    if (j >= pairs.size()) break;
    if (at[j] - at[i] > longest) continue;
    const SE3 truth = pairs[i].T_world_truth.inverse() * pairs[j].T_world_truth;
    const SE3 estimate = pairs[i].T_world_estimate.inverse() * pairs[j].T_world_estimate;
    const SE3 error = truth.inverse() * estimate;
    result.spans.push_back({pairs[i].stamp, error.translation().norm(), error.angle()});
    translations.push_back(result.spans.back().translation_m);
    rotations.push_back(result.spans.back().rotation_rad);
  }
  result.translation_m = summarise(translations);
  result.rotation_rad = summarise(rotations);
  return result;
}

Result<TrajectoryError> evaluate_trajectory(const Trajectory& truth, const Trajectory& estimate,
                                            const TrajectoryErrorParams& params) {
  TrajectoryError result;
  result.matched = associate(truth, estimate, params);
  result.pairs = result.matched.size();
  if (result.pairs < 3) return tl::make_unexpected(too_few_pairs(truth, estimate, result.pairs, params));

  std::vector<Vec3> true_positions, positions;
  for (const PosePair& pair : result.matched) {
    const bool true_is_rigid = is_rigid(pair.T_world_truth);
    if (!true_is_rigid || !is_rigid(pair.T_world_estimate))
      return fail(ErrorCode::kInvalidValue, true_is_rigid ? kEstimatedTrajectory : kTrueTrajectory,
                  "the pose at {:.6f} s is not a rigid motion", pair.stamp.seconds());
    true_positions.push_back(pair.T_world_truth.translation());
    positions.push_back(pair.T_world_estimate.translation());
  }
  if (params.alignment == TrajectoryAlignment::kSim3)
    if (const auto scaled = check_scale(positions); !scaled) return forward_error(scaled);

  result.alignment = align_points(positions, true_positions, params.alignment);
  add_position_errors(result);
  add_rotation_errors(result, params.alignment);
  add_sizes(result, true_positions, positions);
  result.relative = relative_errors(result.matched, params.rpe_unit, params.rpe_delta);
  result.per_frame = relative_errors(result.matched, RpeUnit::kFrames, 1);
  result.per_second = relative_errors(result.matched, RpeUnit::kSeconds, 1);
  result.per_metre = relative_errors(result.matched, RpeUnit::kMetres, 1);
  return result;
}

}  // namespace hm
