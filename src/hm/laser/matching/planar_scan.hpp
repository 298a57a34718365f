#pragma once
#include <cstddef>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/geometry/se2.hpp"

namespace hm {

/// A scan as points of the horizontal plane, in the frame `ortho`: the vehicle's base with its height, roll
/// and pitch taken away (dissertation 2.2.2). Points are in the order of their bearings seen from `origin`
/// (strictly increasing after `sort_by_bearing`, which is what a laser delivers anyway); beams without a
/// return are not in it. This is all that scan matching sees.
struct PlanarScan {
  Time stamp;                       ///< the moment that the points are expressed at
  Vec2 origin_m = Vec2::Zero();     ///< the laser in `ortho`
  std::vector<Vec2> points_m;       ///< in `ortho`
  std::vector<float> bearings_rad;  ///< from `origin_m`, increasing; unwrapped, so it may pass pi
  std::vector<float> ranges_m;      ///< from `origin_m`

  [[nodiscard]] std::size_t size() const { return points_m.size(); }
};

/// Fills bearings and ranges from the points and the origin, and puts all three in order of bearing,
/// beginning after the widest gap between two of them. Points that are not finite or lie on the origin are
/// taken out. O(n) when the points are in order already.
void sort_by_bearing(PlanarScan& scan);

}  // namespace hm
