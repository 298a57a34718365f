#pragma once
#include <optional>
#include <span>
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

/// Length in metres of the path through these positions, in steps of at least 2 cm: positions nearer than
/// that to the last one counted are passed over. Otherwise noise of a millimetre in each pose would add up
/// with the number of poses (0.7 m in 16 m at 40 Hz for laser scan matching), and an estimated path could not
/// be compared with a true one that is sampled at another rate.
double path_length(std::span<const Vec3> positions_m);
double path_length(const Trajectory& trajectory);

}  // namespace hm
