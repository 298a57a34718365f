#pragma once
#include "hm/geometry/camera.hpp"
#include "hm/odometry/tracker/local_map.hpp"

namespace hm {

struct WindowAdjustmentParams {
  std::size_t keyframes = 7;  ///< newest ones, whose poses move
  int iterations = 4;
  double surface_weight_ratio = 1;  ///< of the factors between surfaces
};

struct WindowAdjustmentResult {
  double cost_before = 0, cost_after = 0;
  int accepted_steps = 0;
};

/// Moves the newest keyframes and the landmarks they saw so that sightings (pixel and depth) and surfaces
/// agree best: Levenberg-Marquardt with the landmarks eliminated (Schur complement; Triggs et al. 2000),
/// robust (Cauchy). Older keyframes that saw the same landmarks stay where they are; without any, the oldest
/// of the window does. Landmarks get the covariance that the sightings give them.
WindowAdjustmentResult adjust_window(LocalMap& map, const PinholeCamera& camera,
                                     const WindowAdjustmentParams& params);

}  // namespace hm
