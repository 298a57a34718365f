#pragma once
#include <vector>

#include "hm/odometry/feature/feature.hpp"

namespace hm {

/// Indices of two matched features and their descriptor distance.
struct FeatureMatch {
  int a = 0, b = 0;
  int distance_bits = 0;
};

struct MatchLimits {
  double max_ratio = 0.8;       ///< best to second best distance; 1 or more: no ratio test
  int max_distance_bits = 256;  ///< best distance
  bool mutual = false;          ///< each must be the other's nearest
  bool only_with_depth = true;
};

/// Matches each feature of `b` to the nearest of `a` by descriptor, if it passes the limits (Lowe's ratio
/// test); in the order of b. Brute force; ties go to the first.
std::vector<FeatureMatch> match_descriptors(const FeatureSet& a, const FeatureSet& b,
                                            const MatchLimits& limits);

}  // namespace hm
