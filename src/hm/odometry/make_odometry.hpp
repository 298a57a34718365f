#pragma once
#include "hm/odometry/interface/visual_odometry.hpp"

namespace hm {

/// The method that the parameters name. The camera must be free of lens distortion.
std::unique_ptr<VisualOdometry> make_visual_odometry(const OdometryParams& params,
                                                     const PinholeCamera& camera,
                                                     const SE3& T_odom_first_camera = {});

}  // namespace hm
