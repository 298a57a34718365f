#pragma once
#include <vector>

#include "hm/odometry/tracker/local_map.hpp"
#include "hm/odometry/tracker/tracker_frame.hpp"

namespace hm {

struct MatchingParams {
  PatchSearch search;
  double pixel_sigma_px = 0.5;  ///< added to every match: error not modelled by patch alignment
  DepthNoise noise;
  double max_depth_m = 5.5, max_depth_sigma_m = 0.05;
  std::size_t limit = 220;
};

/// Searches for the landmarks visible at the predicted pose, by aligning the patch of each around its
/// predicted pixel. `looked_for` receives the indices of all landmarks searched for.
std::vector<LandmarkMatch> match_landmarks(const LocalMap& map, const TrackerFrame& frame,
                                           const SE3& T_odom_camera, const PinholeCamera& camera,
                                           const MatchingParams& params,
                                           std::vector<std::size_t>& looked_for);

/// Number of matches with a depth reading.
int count_with_depth(const std::vector<LandmarkMatch>& matches);

}  // namespace hm
