#pragma once
#include <memory>
#include <optional>
#include <string>

#include "hm/core/time.hpp"
#include "hm/odometry/feature/keyframe.hpp"
#include "hm/odometry/interface/visual_odometry.hpp"

namespace hm {

/// Record of one frame given to visual odometry.
struct TrackedRecord {
  std::size_t index = 0;   ///< in the recording
  bool was_read = false;   ///< else nothing but `reason` is set
  bool is_mapped = false;  ///< the map has it, or will when a loop connects its submap
  Time stamp;
  TrackingStatus status = TrackingStatus::kSkipped;
  std::string reason;  ///< when there is no pose
  int submap = 0;
  double sigma_m = 0;   ///< of the position, as the covariance has it: root of the trace
  double wait_ms = 0;   ///< for the images
  double frame_ms = 0;  ///< tracking and mapping
  TrackingNumbers numbers;
  std::optional<SE3> T_odom_camera;
  std::shared_ptr<const Keyframe> keyframe;  ///< set where the frame became one

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(index, was_read, is_mapped, stamp, reason, submap, sigma_m, wait_ms, frame_ms, numbers,
            T_odom_camera);
    archive.choice(status, 6);
    bool has_keyframe = keyframe != nullptr;
    archive(has_keyframe);
    if (!has_keyframe || !archive.ok()) return;
    if constexpr (Archive::kReads) {
      auto read = std::make_shared<Keyframe>();
      archive(*read);
      keyframe = std::move(read);
    } else {
      archive(const_cast<Keyframe&>(*keyframe));  // a writer changes nothing
    }
  }
};

}  // namespace hm
