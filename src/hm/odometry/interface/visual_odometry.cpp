#include "hm/odometry/interface/visual_odometry.hpp"

#include "hm/core/check.hpp"

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

bool VisualOdometry::save(StateWriter& /*state*/) const { return false; }
Result<void> VisualOdometry::restore(StateReader& /*state*/, const OdometryHistory& /*history*/) {
  return fail(ErrorCode::kUnsupported, "odometry",
              "this method cannot continue where an earlier run stopped");
}

}  // namespace hm
