#pragma once
#include <memory>

#include "hm/odometry/interface/visual_odometry.hpp"

namespace hm {

/// Creates the default method (OdometryMethod::kTracker): landmarks of a persistent model are found by patch
/// alignment, registered together with the depth image's surface, and adjusted in a window of keyframes.
std::unique_ptr<VisualOdometry> make_tracker(const OdometryParams& params, const PinholeCamera& camera,
                                             const SE3& T_odom_first_camera = {});

}  // namespace hm
