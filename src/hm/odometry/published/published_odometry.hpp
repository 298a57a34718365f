#pragma once
#include <memory>

#include "hm/odometry/interface/visual_odometry.hpp"

namespace hm {

/// The dissertation's pipeline as it was published (3.2): features -> prediction (none, or RANSAC frame to
/// frame) -> ICP against the persistent model -> association by Mahalanobis distance -> Kalman update; or the
/// motion from frame to frame alone. `params.method` is one of the three kPublished..., kFrameToFrame.
/// A frame that cannot be registered changes nothing; the next ones are tried from the last pose and looked
/// for among the keyframes (relocalisation.hpp), and after `max_lost_frames` a new submap begins there. Hints
/// are not used. Covariances are those of the registration alone: the model counts as independent of the
/// frame.
std::unique_ptr<VisualOdometry> make_published_odometry(const OdometryParams& params,
                                                        const PinholeCamera& camera,
                                                        const SE3& T_odom_first_camera = {});

}  // namespace hm
