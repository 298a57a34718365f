#pragma once
#include <optional>

#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/odometry/tracker/gravity_estimator.hpp"

namespace hm {

/// What the tracker makes of hints about the motion: the turn since the last frame with a pose, and up.
class TrackerInertia {
 public:
  explicit TrackerInertia(double gravity_sigma_rad) : gravity_sigma_rad_(gravity_sigma_rad) {}

  /// A frame has come, whatever will become of it.
  void begin_frame(const MotionHint& hint);
  /// The turn of the camera since the last frame with a pose; unknown as soon as a part of it is.
  [[nodiscard]] const std::optional<Mat3>& R_posed_current() const { return R_posed_current_; }
  /// What gravity says about a frame that is likely to be at this pose, into `frame.up`.
  GravityUse weigh(const SE3& T_odom_camera_guess, const MotionHint& hint, TrackerFrame& frame) const;
  /// What became of the frame, and its pose if it has one.
  void end_frame(Time stamp, const MotionHint& hint, TrackingStatus status, const SE3& T_odom_camera);

 private:
  double gravity_sigma_rad_;
  std::optional<Mat3> R_posed_current_;
  std::optional<Vec3> up_odom_;  ///< by hints that say up themselves
  GravityEstimator gravity_;
};

}  // namespace hm
