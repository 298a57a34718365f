#pragma once
#include <memory>

#include "hm/odometry/interface/visual_odometry.hpp"

namespace hm {

/// Odometry by the method that the parameters name (the tracker by default). `camera`: of depth and colour,
/// without lens distortion. `T_odom_first_camera`: the pose that the first frame gets.
std::unique_ptr<VisualOdometry> make_visual_odometry(const OdometryParams& params,
                                                     const PinholeCamera& camera,
                                                     const SE3& T_odom_first_camera = {});

}  // namespace hm
