#include "hm/odometry/interface/visual_odometry.hpp"

#include <algorithm>

#include "hm/core/check.hpp"
#include "hm/odometry/feature/keyframe.hpp"

namespace hm {

std::string_view to_string(TrackingStatus status) {
  switch (status) {
    case TrackingStatus::kTracked:
      return "tracked";
    case TrackingStatus::kStarted:
      return "started";
    case TrackingStatus::kRelocalised:
      return "relocalised";
    case TrackingStatus::kBridged:
      return "bridged";
    case TrackingStatus::kLost:
      return "lost";
    case TrackingStatus::kSkipped:
      return "skipped";
  }
  HM_CHECK(false, "{}", static_cast<int>(status));
  return {};
}

std::shared_ptr<const Keyframe> OdometryHistory::find_keyframe(std::size_t frame_index) const {
  const auto at = std::lower_bound(
      keyframes.begin(), keyframes.end(), frame_index,
      [](const std::shared_ptr<const Keyframe>& k, std::size_t i) { return k->frame_index < i; });
  return at != keyframes.end() && (*at)->frame_index == frame_index ? *at : nullptr;
}

bool VisualOdometry::save(StateWriter& /*state*/) const { return false; }
Result<void> VisualOdometry::restore(StateReader& /*state*/, const OdometryHistory& /*history*/) {
  return fail(ErrorCode::kUnsupported, "odometry",
              "this method cannot continue where an earlier run stopped");
}

}  // namespace hm
