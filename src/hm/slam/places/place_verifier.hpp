#pragma once
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "hm/odometry/feature/keyframe.hpp"
#include "hm/slam/places/place_params.hpp"
#include "hm/slam/places/place_registration.hpp"

namespace hm {

enum class PlaceOutcome {
  kSamePlace,
  kFewMatches,  ///< less than min_inliers features look alike
  kNoMotion,    ///< no motion explains enough of them
  kConflict,    ///< the motion puts what one sees before or behind what the other sees
  kAmbiguous,   ///< another motion explains nearly as many
  kDegenerate,  ///< the inliers do not determine a motion (all on a line)
};
std::string_view to_string(PlaceOutcome outcome);

/// Result of comparing two keyframes.
struct PlaceMatch {
  PlaceOutcome outcome = PlaceOutcome::kFewMatches;
  int matches = 0;
  int inliers = 0;
  SE3 T_a_b;
  Mat6 covariance = Mat6::Zero();  ///< of the move (moved_by) of T_a_b
  std::vector<FeaturePair> pairs;  ///< inliers: features of a and of b
  [[nodiscard]] bool is_same_place() const { return outcome == PlaceOutcome::kSamePlace; }
};

/// Features of two keyframes that are each other's nearest, close and distinct, both with depth.
std::vector<FeaturePair> match_features(const FeatureSet& a, const FeatureSet& b,
                                        const PlaceVerifierParams& params);

/// Whether two keyframes show the same place, and the motion between them: matches, RANSAC over three of
/// them, inliers by Mahalanobis distance with a cap, weighted least squares (dissertation 3.3.1). The result
/// depends on the arguments only. Swapping a and b inverts the motion, and little else.
PlaceMatch verify_place(const Keyframe& a, const Keyframe& b, const PlaceVerifierParams& params = {});

/// verify_place() for given matches instead of its own; sorted, all with depth.
PlaceMatch verify_matches(const Keyframe& a, const Keyframe& b, std::span<const FeaturePair> matches,
                          const PlaceVerifierParams& params = {});

}  // namespace hm
