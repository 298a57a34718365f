#pragma once
#include <span>

#include "hm/odometry/feature/descriptor_matching.hpp"
#include "hm/odometry/registration/ransac.hpp"

namespace hm {

/// How features are matched and what agrees.
struct FrameMatchParams {
  MatchLimits limits;
  RansacParams ransac;
};

/// The motion of the camera between two frames, from features that look alike (dissertation 3.2, the step
/// that predicts for the registration to the model).
struct FrameMotion {
  RansacMotion motion;  ///< T_a_b in the CAMERA frame: compose T_odom_b = T_odom_a * T_a_b
  int matches = 0;
};

/// Pairs of points from matches; all matched features must have depth.
std::vector<PointPair> point_pairs(const FeatureSet& a, const FeatureSet& b,
                                   std::span<const FeatureMatch> matches);

/// Matches by descriptor, then RANSAC over the matched points. `a` is the earlier frame.
FrameMotion match_frames(const FeatureSet& a, const FeatureSet& b, const FrameMatchParams& params, Rng& rng);

}  // namespace hm
