#pragma once
#include "hm/geometry/camera.hpp"
#include "hm/odometry/tracker/local_map.hpp"

namespace hm {

struct WindowAdjustmentParams {
  std::size_t keyframes = 7;  ///< number of newest keyframes whose poses are adjusted
  int iterations = 4;
  double surface_weight_ratio = 1;  ///< weight of the surface factors
};

struct WindowAdjustmentResult {
  double cost_before = 0, cost_after = 0;
  int accepted_steps = 0;
};

/// Bundle adjustment of the newest keyframes and their landmarks over sightings (pixel and depth) and surface
/// factors: Levenberg-Marquardt with the landmarks eliminated (Schur complement; Triggs et al. 2000), robust
/// (Cauchy). Older keyframes that observe the same landmarks are fixed; if there are none, the oldest of the
/// window is. Updates the landmarks' covariances.
WindowAdjustmentResult adjust_window(LocalMap& map, const PinholeCamera& camera,
                                     const WindowAdjustmentParams& params);

}  // namespace hm
