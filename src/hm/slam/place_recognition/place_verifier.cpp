#include "hm/slam/place_recognition/place_verifier.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "hm/geometry/solvers/small_solvers.hpp"
#include "hm/slam/place_recognition/hamming_rows.hpp"

namespace hm {
namespace {

/// Maximum standard deviation in the least certain direction of an accepted registration.
constexpr double kMaxSigma_m = 0.1, kMaxSigma_rad = 0.06;
/// Transforms closer than this count as equal.
constexpr double kSameMotion_m = 0.1, kSameMotion_rad = 0.06;

/// Features with depth, descriptors stored contiguously.
struct Described {
  std::vector<std::uint32_t> numbers;
  std::vector<BinaryDescriptor> descriptors;
  explicit Described(const FeatureSet& features) {
    for (std::size_t f = 0; f < features.size(); ++f) {
      if (!features[f].has_depth) continue;
      numbers.push_back(static_cast<std::uint32_t>(f));
      descriptors.push_back(features[f].descriptor);
    }
  }
};

/// Nearest and second nearest neighbour of a descriptor.
struct Nearest {
  int bits = 257, next_bits = 257;
  std::size_t number = 0;
  void offer(int distance, std::size_t candidate) {
    if (distance < bits) {
      next_bits = bits;
      bits = distance;
      number = candidate;
    } else {
      next_bits = std::min(next_bits, distance);
    }
  }
  [[nodiscard]] bool is_distinct(const PlaceVerifierParams& params) const {
    return bits <= params.kMaxMatchBits && bits < params.kMatchRatio * next_bits;
  }
};

bool differs(const SE3& a, const SE3& b) {
  const SE3 between = a.inverse() * b;
  return between.translation().norm() > kSameMotion_m || between.angle() > kSameMotion_rad;
}

/// True if the outliers of the best transform agree on a different one.
bool has_rival(const FeatureSet& a, const FeatureSet& b, std::span<const FeaturePair> matches,
               const MotionHypothesis& best, const PlaceVerifierParams& params) {
  const auto wanted = static_cast<std::size_t>(params.rival_ratio * static_cast<double>(best.inliers.size()));
  std::vector<FeaturePair> rest;
  std::set_difference(matches.begin(), matches.end(), best.inliers.begin(), best.inliers.end(),
                      std::back_inserter(rest));
  if (rest.size() < std::max<std::size_t>(4, wanted)) return false;
  const auto rival = register_features(a, b, rest, params);
  return rival && rival->inliers.size() >= wanted && differs(rival->T_a_b, best.T_a_b);
}

bool is_certain(const Mat6& covariance) {
  const auto largest = [](const Mat3& block) { return symmetric_eigenvalues(block).maxCoeff(); };
  return covariance.allFinite() && largest(covariance.topLeftCorner<3, 3>()) < kMaxSigma_m * kMaxSigma_m &&
         largest(covariance.bottomRightCorner<3, 3>()) < kMaxSigma_rad * kMaxSigma_rad;
}

}  // namespace

std::string_view to_string(PlaceOutcome outcome) {
  switch (outcome) {
    case PlaceOutcome::kSamePlace:
      return "same place";
    case PlaceOutcome::kFewMatches:
      return "few matches";
    case PlaceOutcome::kNoMotion:
      return "no motion";
    case PlaceOutcome::kConflict:
      return "conflict";
    case PlaceOutcome::kAmbiguous:
      return "ambiguous";
    case PlaceOutcome::kDegenerate:
      return "degenerate";
  }
  return "?";
}

std::vector<FeaturePair> match_features(const FeatureSet& a, const FeatureSet& b,
                                        const PlaceVerifierParams& params) {
  const Described in_a(a), in_b(b);
  std::vector<Nearest> of_a(in_a.numbers.size()), of_b(in_b.numbers.size());
  std::vector<std::uint16_t> bits(in_b.numbers.size());
  for (std::size_t i = 0; i < of_a.size(); ++i) {
    detail::hamming_row(in_a.descriptors[i], in_b.descriptors, bits);
    for (std::size_t j = 0; j < bits.size(); ++j) {
      of_a[i].offer(bits[j], j);
      of_b[j].offer(bits[j], i);
    }
  }
  std::vector<FeaturePair> matches;
  for (std::size_t i = 0; i < of_a.size(); ++i) {
    if (of_b.empty() || !of_a[i].is_distinct(params)) continue;
    const std::size_t j = of_a[i].number;
    if (of_b[j].number == i && of_b[j].is_distinct(params))
      matches.emplace_back(in_a.numbers[i], in_b.numbers[j]);
  }
  return matches;
}

PlaceMatch verify_place(const Keyframe& a, const Keyframe& b, const PlaceVerifierParams& params) {
  return verify_matches(a, b, match_features(a.features, b.features, params), params);
}

PlaceMatch verify_matches(const Keyframe& a, const Keyframe& b, std::span<const FeaturePair> matches,
                          const PlaceVerifierParams& params) {
  PlaceMatch result;
  result.matches = static_cast<int>(matches.size());
  if (result.matches < params.kMinSeeds) return result;
  result.outcome = PlaceOutcome::kNoMotion;
  auto best = register_features(a.features, b.features, matches, params);
  if (!best) return result;
  result.inliers = static_cast<int>(best->inliers.size());
  const auto seeds = static_cast<double>(best->inliers.size());
  if (seeds < params.kMinSeeds || seeds < params.kMinSeedRatio * result.matches) return result;
  const bool is_rivalled = has_rival(a.features, b.features, matches, *best, params);
  refine_guided(a.features, b.features, params, *best);
  result.inliers = static_cast<int>(best->inliers.size());
  result.T_a_b = best->T_a_b;
  if (result.inliers < params.min_inliers) return result;
  result.pairs = std::move(best->inliers);
  result.covariance = best->information.ldlt().solve(Mat6::Identity());
  const double floor_m2 = params.sigma_floor_m * params.sigma_floor_m;
  const double floor_rad2 = params.sigma_floor_rad * params.sigma_floor_rad;
  result.covariance.diagonal() += (Vec6() << Vec3::Constant(floor_m2), Vec3::Constant(floor_rad2)).finished();
  result.outcome = !is_certain(result.covariance) ? PlaceOutcome::kDegenerate
                   : is_rivalled                  ? PlaceOutcome::kAmbiguous
                   : conflict_ratio(a.features, b.features, result.T_a_b) > params.kMaxConflictRatio
                       ? PlaceOutcome::kConflict
                       : PlaceOutcome::kSamePlace;
  return result;
}

}  // namespace hm
