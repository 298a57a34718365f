#pragma once
#include <optional>
#include <span>

#include "hm/geometry/level/up_direction.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/sensors/imu.hpp"

namespace hm {

/// Up in the world of a camera's path, from what an accelerometer felt along it; `samples` in the camera's
/// frame. Nothing where less than a second of the path is covered, or where the length of what was felt is
/// not that of gravity within 0.7 m/s^2 (a fall, blows, a device that is turned otherwise than it is said to
/// be).
///
/// Over stretches of 1.5 s the mean of the specific force, turned into the world, less the change of the
/// path's velocity is g + M b: gravity g and the accelerometer's bias b, with the mean rotation M (as
/// GravityEstimator of odometry has it). Both come from all stretches at once by least squares; the bias has
/// a prior of 0.5 m/s^2, as cheap sensors need (the first Kinect: 0.5), and is observed as far as the camera
/// turns. `sigma_rad` is that of the posterior.
std::optional<UpDirection> up_along_path(std::span<const ImuSample> samples,
                                         const Trajectory& T_world_camera);

/// Up in the camera's frame about a moment, from the mean of what was felt within 0.25 s of it: as good as
/// the camera is at rest. Nothing without readings, or where their mean is not as long as gravity.
std::optional<UpDirection> up_about(std::span<const ImuSample> samples, Time stamp);

}  // namespace hm
