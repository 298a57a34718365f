#pragma once
#include <vector>

#include "hm/odometry/tracker/local_map.hpp"
#include "hm/odometry/tracker/tracker_frame.hpp"

namespace hm {

struct MatchingParams {
  PatchSearch search;
  double pixel_sigma_px = 0.5;  ///< added to that of every match: what patches do not know of themselves
  DepthNoise noise;
  double max_depth_m = 5.5, max_depth_sigma_m = 0.05;
  std::size_t limit = 220;
};

/// Looks for the landmarks of the model that the predicted pose shows, by aligning the patch of each around
/// its predicted pixel, and counts in the model what was looked for.
std::vector<LandmarkMatch> match_landmarks(const LocalMap& map, const TrackerFrame& frame,
                                           const SE3& T_odom_camera, const PinholeCamera& camera,
                                           const MatchingParams& params,
                                           std::vector<std::size_t>& looked_for);

/// How many of the matches have a depth reading.
int count_with_depth(const std::vector<LandmarkMatch>& matches);

}  // namespace hm
