#pragma once
#include <string>
#include <vector>

#include "hm/geometry/se3.hpp"
#include "hm/mvog/multi_volume_grid.hpp"

namespace hm {

/// A straight flight to a goal, or why it cannot be flown.
struct StraightWay {
  std::vector<Vec3> points_m;  ///< from the vehicle to the goal, or to where the way ends
  std::string refusal;         ///< empty: the way is free
};

/// Parameters of a straight flight.
struct StraightWayParams {
  double hull_radius_m = 0.34;
  /// Around the vehicle, where its laser cannot see, space counts as free.
  double free_start_m = 0.5;
  /// A laser sees one plane: a place is known when something within this height of the way is known.
  double seen_height_m = 0.25;
  double longest_m = 50;
};

/// Checks the straight way through the grid: over its whole width nothing may be occupied, and every place
/// must be known to be free. Points in the frame of the grid.
StraightWay straight_way(const MultiVolumeGrid& grid, const Vec3& from_m, const Vec3& to_m,
                         const StraightWayParams& params = {});

}  // namespace hm
