#pragma once
#include <memory>

#include "hm/odometry/interface/visual_odometry.hpp"

namespace hm {

/// Creates odometry with the method of the parameters (the tracker by default). `camera`: of depth and
/// colour, without lens distortion. `T_odom_first_camera`: pose of the first frame.
std::unique_ptr<VisualOdometry> make_visual_odometry(const OdometryParams& params,
                                                     const PinholeCamera& camera,
                                                     const SE3& T_odom_first_camera = {});

}  // namespace hm
