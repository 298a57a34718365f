#pragma once
#include <vector>

#include "hm/laser/testing/planar_world.hpp"

namespace hm::laser_testing {

/// A floor of 36 m x 24 m: a corridor, 2.4 m wide, in a ring around a core, with rooms of different sizes
/// behind open doors on its outer side and in the core. Always the same.
PlanarWorld ring_corridor_world();
/// Length of the middle line of the corridor, with rounded corners.
inline constexpr double kRingCorridor_m = 108.34;
/// Pose on this line, `distance_m` after its start, facing forward.
SE2 ring_corridor_pose(double distance_m);

}  // namespace hm::laser_testing
