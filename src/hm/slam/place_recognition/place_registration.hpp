#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "hm/odometry/feature/feature.hpp"
#include "hm/slam/place_recognition/place_params.hpp"

namespace hm {

/// Indices of two features, one of `a` and one of `b`.
using FeaturePair = std::pair<std::uint32_t, std::uint32_t>;

/// Least-squares rigid transform T_a_b from points of b to points of a (Arun et al. 1987, Umeyama 1991);
/// nothing for fewer than three points.
std::optional<SE3> fit_motion(std::span<const Vec3> p_a, std::span<const Vec3> p_b);

/// Transform and the matches consistent with it.
struct MotionHypothesis {
  SE3 T_a_b;
  Mat6 information = Mat6::Zero();  ///< of a perturbation of T_a_b (moved_by)
  std::vector<FeaturePair> inliers;
};

/// Estimates the transform with most inliers by RANSAC: samples of three matches with consistent mutual
/// distances, inliers by squared Mahalanobis distance and distance limit (params.kMaxMatchChi2,
/// kMaxMatchDistance_m), then weighted least squares with updated inliers. Nothing when no sample has four
/// inliers. Deterministic. All features of `matches` must have depth.
std::optional<MotionHypothesis> register_features(const FeatureSet& a, const FeatureSet& b,
                                                  std::span<const FeaturePair> matches,
                                                  const PlaceVerifierParams& params);

/// Matches features by predicted position: for each feature of b, the one of a with the most similar
/// descriptor among those consistent with the transform (limits as above), mutually, at most
/// params.kMaxGuidedBits apart. Sorted.
std::vector<FeaturePair> match_guided(const FeatureSet& a, const FeatureSet& b, const SE3& T_a_b,
                                      const PlaceVerifierParams& params);

/// Refines a hypothesis by two rounds of guided matching and weighted least squares.
void refine_guided(const FeatureSet& a, const FeatureSet& b, const PlaceVerifierParams& params,
                   MotionHypothesis& hypothesis);

/// Share of b's features whose transformed depth differs clearly from that of every feature of a in the same
/// direction (within kSameDirection_rad), among those with such a neighbour. Large if similar features agree
/// on a transform but the surrounding geometry differs.
inline constexpr double kSameDirection_rad = 0.03;
double conflict_ratio(const FeatureSet& a, const FeatureSet& b, const SE3& T_a_b);

/// Squared Mahalanobis distance of a match for a transform.
double match_chi2(const Feature& a, const Feature& b, const SE3& T_a_b);

/// Derivative of p_a - T_a_b p_b with respect to a perturbation of T_a_b (moved_by).
Eigen::Matrix<double, 3, 6> match_jacobian(const SE3& T_a_b, const Vec3& p_b);

}  // namespace hm
