#pragma once
#include <optional>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Pose with its timestamp. For cameras, `base` is the colour/depth optical frame.
struct StampedPose {
  Time stamp;
  SE3 T_world_base;
};

/// Poses with strictly increasing stamps.
using Trajectory = std::vector<StampedPose>;

/// Pose at a time: interpolated between its neighbours when they are at most `max_gap` apart, the first or
/// last pose when the time is beyond it by at most `max_extrapolation`; otherwise nothing.
std::optional<SE3> pose_at(const Trajectory& trajectory, Time stamp, Duration max_gap,
                           Duration max_extrapolation = {});

/// Length of the path in metres.
double path_length(const Trajectory& trajectory);

}  // namespace hm
