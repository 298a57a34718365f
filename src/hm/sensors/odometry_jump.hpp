#pragma once
#include "hm/geometry/trajectory.hpp"

namespace hm {

/// Whether odometry jumps from one reading to the next, further than a vehicle in a building moves (a metre
/// or more, at over 5 m/s): it was reset, or one reading is wrong.
inline bool odometry_jumps(const StampedPose& from, const StampedPose& to) {
  constexpr double kLeast_m = 1, kMost_m_s = 5;
  const double way_m = (to.T_world_base.translation() - from.T_world_base.translation()).norm();
  return !(way_m < kLeast_m) && !(way_m < kMost_m_s * (to.stamp - from.stamp).seconds());
}

}  // namespace hm
