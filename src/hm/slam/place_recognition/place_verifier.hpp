#pragma once
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "hm/odometry/feature/keyframe.hpp"
#include "hm/slam/place_recognition/place_params.hpp"
#include "hm/slam/place_recognition/place_registration.hpp"

namespace hm {

enum class PlaceOutcome {
  kSamePlace,
  kFewMatches,  ///< too few descriptor matches
  kNoMotion,    ///< no transform has enough inliers
  kConflict,    ///< the depths of both keyframes contradict the transform
  kAmbiguous,   ///< another transform has nearly as many inliers
  kDegenerate,  ///< the inliers do not determine the transform (collinear)
};
std::string_view to_string(PlaceOutcome outcome);

/// Result of comparing two keyframes.
struct PlaceMatch {
  PlaceOutcome outcome = PlaceOutcome::kFewMatches;
  int matches = 0;
  int inliers = 0;
  SE3 T_a_b;
  Mat6 covariance = Mat6::Zero();  ///< of a perturbation of T_a_b (moved_by)
  std::vector<FeaturePair> pairs;  ///< inliers
  [[nodiscard]] bool is_same_place() const { return outcome == PlaceOutcome::kSamePlace; }
};

/// Matches features with depth by descriptor: mutual nearest neighbours that pass the distance and ratio
/// tests.
std::vector<FeaturePair> match_features(const FeatureSet& a, const FeatureSet& b,
                                        const PlaceVerifierParams& params);

/// Decides whether two keyframes show the same place and estimates the transform between them: descriptor
/// matches, RANSAC over samples of three, inliers by Mahalanobis distance with a limit, weighted least
/// squares (dissertation 3.3.1). Deterministic. Swapping a and b inverts the result up to small differences.
PlaceMatch verify_place(const Keyframe& a, const Keyframe& b, const PlaceVerifierParams& params = {});

/// verify_place() for given matches, which must be sorted and have depth.
PlaceMatch verify_matches(const Keyframe& a, const Keyframe& b, std::span<const FeaturePair> matches,
                          const PlaceVerifierParams& params = {});

}  // namespace hm
