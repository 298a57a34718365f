#pragma once
#include <cstddef>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/geometry/se2.hpp"

namespace hm {

/// Scan as points in the horizontal plane, in the frame `ortho`: the vehicle's base without height, roll and
/// pitch (dissertation 2.2.2). Points are sorted by bearing as seen from `origin_m` (strictly increasing
/// after `sort_by_bearing`; lasers deliver this order); beams without a return are dropped. The only input of
/// scan matching.
struct PlanarScan {
  Time stamp;                       ///< reference time of the points
  Vec2 origin_m = Vec2::Zero();     ///< position of the laser in `ortho`
  std::vector<Vec2> points_m;       ///< in `ortho`
  std::vector<float> bearings_rad;  ///< from `origin_m`, increasing; unwrapped, so it may pass pi
  std::vector<float> ranges_m;      ///< from `origin_m`

  [[nodiscard]] std::size_t size() const { return points_m.size(); }
};

/// Computes bearings and ranges from the points and the origin and sorts all three by bearing, starting after
/// the widest gap. Points that are not finite or coincide with the origin are removed. O(n) if already
/// sorted.
void sort_by_bearing(PlanarScan& scan);

}  // namespace hm
