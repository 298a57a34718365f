#pragma once
#include <memory>

#include "hm/odometry/interface/visual_odometry.hpp"

namespace hm {

/// Creates the pipeline as published (dissertation 3.2): features -> prediction (none, or frame-to-frame
/// RANSAC) -> ICP against the persistent model -> association by Mahalanobis distance -> Kalman update; or
/// frame-to-frame motion only. `params.method` is one of kPublished..., kFrameToFrame. A frame that cannot be
/// registered changes nothing; later frames are registered from the last pose and relocalised against
/// keyframes (relocalisation.hpp), and after `max_lost_frames` a new submap begins. Motion hints are ignored.
/// Covariances are those of the registration only, with the model assumed independent of the frame.
std::unique_ptr<VisualOdometry> make_published_odometry(const OdometryParams& params,
                                                        const PinholeCamera& camera,
                                                        const SE3& T_odom_first_camera = {});

}  // namespace hm
