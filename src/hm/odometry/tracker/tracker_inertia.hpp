#pragma once
#include <optional>

#include "hm/odometry/inertial/inertial_tracking.hpp"
#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/odometry/tracker/gravity_estimator.hpp"
#include "hm/odometry/tracker/tracker_registration.hpp"

namespace hm {

/// Evaluates motion hints for the tracker: the rotation since the last frame with a pose, the up direction,
/// and the pose that the readings predict.
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

  /// Pose by the readings, once these are trusted; then also `frame.prior`.
  [[nodiscard]] std::optional<InertialPrediction> predict(TrackerFrame& frame) const;
  /// Whether a registration is far from the prediction.
  [[nodiscard]] static bool is_far(const InertialPrediction& prediction, const Registration& registration);
  /// The same, while the prediction is to be preferred: after some bridged frames, or with many inliers, the
  /// images are right.
  [[nodiscard]] bool contradicts(const InertialPrediction& prediction,
                                 const Registration& registration) const;
  /// A pose was accepted. `T_by_velocity`: where constant velocity would have it.
  void accept(const TrackerFrame& frame, const Registration& registration, TrackingStatus status,
              const SE3& T_by_velocity);
  /// The model begins anew at a predicted pose, which later frames refer to.
  void begin_model(const TrackerFrame& frame, const SE3& T_odom_camera, const InertialPrediction& prediction);
  /// Rotation between two keyframes by the gyroscope, its covariance in the registration's units.
  [[nodiscard]] std::optional<GyroTurn> turn(Time begin, Time end) const;
  void model_moved(const SE3& T_new_old) { tracking_.move(T_new_old); }
  [[nodiscard]] InertialUse use() const { return tracking_.use(); }
  [[nodiscard]] std::size_t memory_bytes() const { return tracking_.memory_bytes(); }

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(R_posed_current_, up_odom_, gravity_, tracking_, scale_, bridged_);
  }

 private:
  double gravity_sigma_rad_;
  std::optional<Mat3> R_posed_current_;
  std::optional<Vec3> up_odom_;  ///< from hints with an up direction
  GravityEstimator gravity_;
  InertialTracking tracking_;
  double scale_ = 1;  ///< of the last registration's covariance
  int bridged_ = 0;   ///< frames in a row
};

}  // namespace hm
