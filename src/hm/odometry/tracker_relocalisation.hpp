#pragma once
#include <optional>

#include "hm/odometry/local_map.hpp"
#include "hm/odometry/ransac.hpp"

namespace hm {

/// A pose found again, and against which keyframe.
struct Relocalisation {
  SE3 T_odom_camera;
  std::size_t keyframe = 0;  ///< identity
  int inliers = 0;
};

/// Compares a frame's features with those of keyframes of the model by descriptor, and looks for the motion
/// that most pairs agree with (RANSAC, Mahalanobis test). `first` says with which keyframe to begin, counted
/// from the newest; at most `count` are tried, so that a search through the whole model can be spread over
/// frames. Nothing when none of them fits; `best_matches` then tells how near it came.
struct RelocalisationSearch {
  std::size_t first = 0, count = 4;
  int min_inliers = 15;
};
std::optional<Relocalisation> find_again(const LocalMap& map, const FeatureSet& features,
                                         const RelocalisationSearch& search, int& best_matches);

}  // namespace hm
