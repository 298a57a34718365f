#pragma once
#include <optional>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// A pose at a moment. For a camera: the colour/depth optical frame in the world.
struct StampedPose {
  Time stamp;
  SE3 T_world_base;
};

/// Poses in order of time (strictly increasing stamps).
using Trajectory = std::vector<StampedPose>;

/// The pose at a moment: interpolated between its neighbours when they are at most `max_gap` apart, the
/// nearest pose when it is within `max_extrapolation` of an end; nothing otherwise.
std::optional<SE3> pose_at(const Trajectory& trajectory, Time stamp, Duration max_gap,
                           Duration max_extrapolation = {});

/// The length of the path in metres.
double path_length(const Trajectory& trajectory);

}  // namespace hm
