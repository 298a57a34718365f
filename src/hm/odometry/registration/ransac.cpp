#include "hm/odometry/registration/ransac.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace hm {

namespace {

constexpr int kMaxRefits = 5;
constexpr double kLeastSineSquared = 1e-3;  ///< of the angle between two sides of a sample's triangle

using Sample = std::array<PointPair, 3>;

bool agrees(const PointPair& pair, const SE3& T_a_b, const RansacParams& params) {
  const Vec3 residual = pair.residual(T_a_b);
  if (residual.squaredNorm() > params.max_distance_m * params.max_distance_m) return false;
  if (params.inlier_test == InlierTest::kDistance) return true;
  return residual.dot(pair.residual_covariance(T_a_b).inverse() * residual) <= params.kMaxChi2;
}

std::vector<int> agreeing(std::span<const PointPair> pairs, const SE3& T_a_b, const RansacParams& params) {
  std::vector<int> inliers;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (agrees(pairs[i], T_a_b, params)) inliers.push_back(static_cast<int>(i));
  }
  return inliers;
}

Sample draw(std::span<const PointPair> pairs, Rng& rng) {
  const auto n = static_cast<std::uint32_t>(pairs.size());
  const std::uint32_t i = rng.below(n);
  std::uint32_t j = rng.below(n - 1);
  j += j >= i ? 1 : 0;
  std::uint32_t k = rng.below(n - 2);
  for (const std::uint32_t used : {std::min(i, j), std::max(i, j)}) k += k >= used ? 1 : 0;
  return {pairs[i], pairs[j], pairs[k]};
}

/// True for a triangle that determines a motion and has equal side lengths in both frames; rejects most bad
/// samples.
bool is_plausible(const Sample& sample, double max_distance_m) {
  for (std::size_t i = 0; i < 3; ++i) {
    const PointPair& from = sample[i];
    const PointPair& to = sample[(i + 1) % 3];
    const double difference = (to.p_a - from.p_a).norm() - (to.p_b - from.p_b).norm();
    if (std::abs(difference) > 2 * max_distance_m) return false;
  }
  const Vec3 u = sample[1].p_a - sample[0].p_a;
  const Vec3 v = sample[2].p_a - sample[0].p_a;
  return u.cross(v).squaredNorm() > kLeastSineSquared * u.squaredNorm() * v.squaredNorm();
}

/// Number of samples needed to include one without outliers with the given confidence.
double needed_samples(std::size_t inliers, std::size_t pairs, double confidence) {
  const double good = std::pow(static_cast<double>(inliers) / static_cast<double>(pairs), 3);
  if (good >= 1) return 0;
  if (good <= 0) return std::numeric_limits<double>::infinity();
  return std::log(1 - confidence) / std::log1p(-good);
}

std::vector<PointPair> selected(std::span<const PointPair> pairs, const std::vector<int>& indices) {
  std::vector<PointPair> chosen;
  chosen.reserve(indices.size());
  for (const int i : indices) chosen.push_back(pairs[static_cast<std::size_t>(i)]);
  return chosen;
}

std::optional<SE3> fit(std::span<const PointPair> inliers, const SE3& start, InlierTest test) {
  if (test == InlierTest::kDistance) return register_points(inliers);
  const auto refined = refine_registration(inliers, start, 0);
  return refined ? std::optional<SE3>(refined->T_a_b) : std::nullopt;
}

/// Refits the motion to its inliers and updates them, as long as none are lost. The first fit may lose a few,
/// since it starts from three points only.
void refit(std::span<const PointPair> pairs, const RansacParams& params, RansacMotion& motion) {
  for (int i = 0; i < kMaxRefits; ++i) {
    const auto fitted = fit(selected(pairs, motion.inliers), motion.T_a_b, params.inlier_test);
    if (!fitted) return;
    std::vector<int> inliers = agreeing(pairs, *fitted, params);
    const std::size_t least = i == 0 ? motion.inliers.size() * 4 / 5 : motion.inliers.size();
    if (inliers.size() < least) return;
    const bool same = inliers == motion.inliers;
    motion.T_a_b = *fitted;
    motion.inliers = std::move(inliers);
    if (same) return;
  }
}

}  // namespace

RansacMotion ransac_registration(std::span<const PointPair> pairs, const RansacParams& params, Rng& rng) {
  RansacMotion best;
  const auto least = static_cast<std::size_t>(std::max(params.min_inliers, 3));
  if (pairs.size() < least) {
    best.reason = fmt::format("{} pairs of points, {} needed", pairs.size(), least);
    return best;
  }
  double needed = params.max_iterations;
  for (; best.iterations < params.max_iterations && best.iterations < needed; ++best.iterations) {
    const Sample sample = draw(pairs, rng);
    if (!is_plausible(sample, params.max_distance_m)) continue;
    const auto T_a_b = register_points(sample);
    if (!T_a_b) continue;
    std::vector<int> inliers = agreeing(pairs, *T_a_b, params);
    if (inliers.size() <= best.inliers.size()) continue;
    best.T_a_b = *T_a_b;
    best.inliers = std::move(inliers);
    needed = needed_samples(best.inliers.size(), pairs.size(), params.kConfidenceRatio);
  }
  if (best.inliers.size() >= 3) refit(pairs, params, best);
  best.found = best.inliers.size() >= least;
  if (best.found) {
    const auto covariance = registration_covariance(selected(pairs, best.inliers), best.T_a_b);
    best.covariance = covariance.value_or(Mat6::Zero());
  } else {
    best.reason =
        fmt::format("{} of {} pairs of points agree, {} needed", best.inliers.size(), pairs.size(), least);
  }
  return best;
}

}  // namespace hm
