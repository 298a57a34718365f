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

}  // namespace hm
