#pragma once
#include "hm/core/time.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Where a vehicle was at one moment as seen from where it was at another, known from elsewhere (verified by
/// people): the yardstick of Kuemmerle et al., "On Measuring the Accuracy of SLAM Algorithms" (2009).
struct PoseRelation {
  Time from, to;  ///< in any order
  SE3 T_from_to;
};

}  // namespace hm
