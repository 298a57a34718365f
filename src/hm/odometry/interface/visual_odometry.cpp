#include "hm/odometry/interface/visual_odometry.hpp"

#include "hm/core/check.hpp"
#include "hm/odometry/published/published_odometry.hpp"
#include "hm/odometry/tracker/tracker.hpp"

namespace hm {

std::string_view to_string(TrackingStatus status) {
  switch (status) {
    case TrackingStatus::kTracked:
      return "tracked";
    case TrackingStatus::kStarted:
      return "started";
    case TrackingStatus::kRelocalised:
      return "relocalised";
    case TrackingStatus::kLost:
      return "lost";
    case TrackingStatus::kSkipped:
      return "skipped";
  }
  HM_CHECK(false, "{}", static_cast<int>(status));
  return {};
}

std::unique_ptr<VisualOdometry> make_visual_odometry(const OdometryParams& params,
                                                     const PinholeCamera& camera,
                                                     const SE3& T_odom_first_camera) {
  if (params.method == OdometryMethod::kTracker) return make_tracker(params, camera, T_odom_first_camera);
  return make_published_odometry(params, camera, T_odom_first_camera);
}

}  // namespace hm
