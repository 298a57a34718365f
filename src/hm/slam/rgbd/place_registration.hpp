#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "hm/odometry/feature.hpp"
#include "hm/slam/rgbd/place_params.hpp"

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
/// by squared Mahalanobis distance with a cap (params.max_match_chi2, max_match_distance_m), then weighted
/// least squares with renewed inliers. The three of a sample count once, like every other match. Nothing when
/// no sample explains four matches. Depends on the arguments only. All features of `matches` have depth.
std::optional<MotionHypothesis> register_features(const FeatureSet& a, const FeatureSet& b,
                                                  std::span<const FeaturePair> matches,
                                                  const PlaceVerifierParams& params);

/// Squared Mahalanobis distance of a match under a motion.
double match_chi2(const Feature& a, const Feature& b, const SE3& T_a_b);

/// Derivative of p_a - T_a_b p_b by the move of T_a_b.
Eigen::Matrix<double, 3, 6> match_jacobian(const SE3& T_a_b, const Vec3& p_b);

}  // namespace hm
