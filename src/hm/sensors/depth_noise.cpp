#include "hm/sensors/depth_noise.hpp"

#include "hm/sensors/rgbd_frame.hpp"
