#include "hm/odometry/make_odometry.hpp"

#include "hm/odometry/published/published_odometry.hpp"
#include "hm/odometry/tracker/tracker.hpp"

namespace hm {

std::unique_ptr<VisualOdometry> make_visual_odometry(const OdometryParams& params,
                                                     const PinholeCamera& camera,
                                                     const SE3& T_odom_first_camera) {
  if (params.method == OdometryMethod::kTracker) return make_tracker(params, camera, T_odom_first_camera);
  return make_published_odometry(params, camera, T_odom_first_camera);
}

}  // namespace hm
