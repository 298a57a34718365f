#pragma once
#include <optional>

#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/odometry/tracker/gravity_estimator.hpp"

namespace hm {

/// Evaluates motion hints for the tracker: the rotation since the last frame with a pose, and the up
/// direction.
class TrackerInertia {
 public:
  explicit TrackerInertia(double gravity_sigma_rad) : gravity_sigma_rad_(gravity_sigma_rad) {}

  /// Starts a frame, before it is tracked.
  void begin_frame(const MotionHint& hint);
  /// Rotation of the camera since the last frame with a pose; unset if any part of it is unknown.
  [[nodiscard]] const std::optional<Mat3>& R_posed_current() const { return R_posed_current_; }
  /// Sets `frame.up` from gravity, for a frame predicted at this pose.
  GravityUse weigh(const SE3& T_odom_camera_guess, const MotionHint& hint, TrackerFrame& frame) const;
  /// Ends a frame with its status and, if tracked, its pose.
  void end_frame(Time stamp, const MotionHint& hint, TrackingStatus status, const SE3& T_odom_camera);

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(R_posed_current_, up_odom_, gravity_);
  }

 private:
  double gravity_sigma_rad_;
  std::optional<Mat3> R_posed_current_;
  std::optional<Vec3> up_odom_;  ///< from hints with an up direction
  GravityEstimator gravity_;
};

}  // namespace hm
