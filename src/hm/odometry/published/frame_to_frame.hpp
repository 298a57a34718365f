#pragma once
#include <span>

#include "hm/odometry/feature/descriptor_matching.hpp"
#include "hm/odometry/registration/ransac.hpp"

namespace hm {

/// Parameters of matching two frames and of RANSAC.
struct FrameMatchParams {
  MatchLimits limits;
  RansacParams ransac;
};

/// Camera motion between two frames by matching features (dissertation 3.2: prediction for the registration
/// to the model).
struct FrameMotion {
  RansacMotion motion;  ///< T_a_b in the camera frame: T_odom_b = T_odom_a * T_a_b
  int matches = 0;
};

/// Point pairs of the matches; all matched features must have depth.
std::vector<PointPair> point_pairs(const FeatureSet& a, const FeatureSet& b,
                                   std::span<const FeatureMatch> matches);

/// Matches by descriptor and estimates the motion by RANSAC over the matched points. `a` is the earlier
/// frame.
FrameMotion match_frames(const FeatureSet& a, const FeatureSet& b, const FrameMatchParams& params, Rng& rng);

}  // namespace hm
