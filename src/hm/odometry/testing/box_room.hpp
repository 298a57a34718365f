#pragma once
#include <cstdint>

#include "hm/core/rng.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// The world of the odometry tests: a closed box of 5 x 4 x 2.6 m around the origin whose walls carry random
/// squares of two sizes, and a smaller box standing in it; depth in closed form.
struct BoxRoom {
  std::uint64_t texture_seed = 1;
  double depth_noise_per_m = 0;  ///< k of sigma = k z^2; 0: exact to the unit of 0.2 mm
};

/// What a camera sees at a pose; `stamp_s` is its time. Noise is drawn by the stamp.
RgbdFrame render(const BoxRoom& room, const PinholeCamera& camera, const SE3& T_world_camera, double stamp_s);

/// A camera of 320 x 240 pixels, 60 degrees wide.
PinholeCamera small_camera();

/// A way through the room: a slow loop with turning, `t_s` seconds after its start.
SE3 way_through_room(double t_s);

}  // namespace hm
