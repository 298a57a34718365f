#pragma once
#include <cstdint>

#include "hm/core/rng.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// World of the odometry tests: a closed box of 5 x 4 x 2.6 m around the origin, textured with random squares
/// of two sizes, and a smaller box inside; depth is exact.
struct BoxRoom {
  std::uint64_t texture_seed = 1;
  double depth_noise_per_m = 0;  ///< k of sigma = k z^2; 0: exact to the unit of 0.2 mm
};

/// Renders the camera's frame at a pose and time; the stamp seeds the noise.
RgbdFrame render(const BoxRoom& room, const PinholeCamera& camera, const SE3& T_world_camera, double stamp_s);

/// Camera of 320 x 240 pixels with a horizontal field of view of 60 degrees.
PinholeCamera small_camera();

/// Pose on a path through the room, a slow loop with rotation, `t_s` seconds after its start.
SE3 way_through_room(double t_s);

}  // namespace hm
