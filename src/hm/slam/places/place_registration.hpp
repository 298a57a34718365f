#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "hm/odometry/feature/feature.hpp"
#include "hm/slam/places/place_params.hpp"

namespace hm {

/// Feature numbers: of a, of b.
using FeaturePair = std::pair<std::uint32_t, std::uint32_t>;

/// The rigid motion that brings points of b onto those of a, least squares (Arun et al. 1987, Umeyama 1991);
/// nothing for fewer than three points.
std::optional<SE3> fit_motion(std::span<const Vec3> p_a, std::span<const Vec3> p_b);

/// A motion with the matches that agree with it.
struct MotionHypothesis {
  SE3 T_a_b;
  Mat6 information = Mat6::Zero();  ///< of the move (moved_by) of T_a_b
  std::vector<FeaturePair> inliers;
};

/// The motion that most matches agree with: samples of three, kept when their mutual distances agree, counted
/// by squared Mahalanobis distance with a cap (params.kMaxMatchChi2, max_match_distance_m), then weighted
/// least squares with renewed inliers. The three of a sample count once, like every other match. Nothing when
/// no sample explains four matches. Depends on the arguments only. All features of `matches` have depth.
std::optional<MotionHypothesis> register_features(const FeatureSet& a, const FeatureSet& b,
                                                  std::span<const FeaturePair> matches,
                                                  const PlaceVerifierParams& params);

/// Matches by place rather than by look: for each feature of b the most alike of a that a motion puts it on
/// (chi2 and cap as above), and the other way round, at most params.kMaxGuidedBits apart. Sorted.
std::vector<FeaturePair> match_guided(const FeatureSet& a, const FeatureSet& b, const SE3& T_a_b,
                                      const PlaceVerifierParams& params);

/// Improves a hypothesis by guided matches and weighted least squares, twice.
void refine_guided(const FeatureSet& a, const FeatureSet& b, const PlaceVerifierParams& params,
                   MotionHypothesis& hypothesis);

/// The share of b's features that a motion puts clearly before or behind what a sees in that direction (its
/// features within kSameDirection_rad), of all that have such a neighbour. Large where look-alikes agree on a
/// motion but the rooms around them differ.
inline constexpr double kSameDirection_rad = 0.03;
double conflict_ratio(const FeatureSet& a, const FeatureSet& b, const SE3& T_a_b);

/// Squared Mahalanobis distance of a match under a motion.
double match_chi2(const Feature& a, const Feature& b, const SE3& T_a_b);

/// Derivative of p_a - T_a_b p_b by the move of T_a_b.
Eigen::Matrix<double, 3, 6> match_jacobian(const SE3& T_a_b, const Vec3& p_b);

}  // namespace hm
