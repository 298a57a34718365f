#pragma once
#include "hm/core/time.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Reference relative pose of a vehicle between two times, known independently (e.g. verified by hand); used
/// to score trajectories as in Kuemmerle et al., "On Measuring the Accuracy of SLAM Algorithms" (2009).
struct PoseRelation {
  Time from, to;  ///< in any order
  SE3 T_from_to;
};

}  // namespace hm
