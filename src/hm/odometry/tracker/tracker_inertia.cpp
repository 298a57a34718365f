#include "hm/odometry/tracker/tracker_inertia.hpp"

#include <cmath>

namespace hm {

void TrackerInertia::begin_frame(const MotionHint& hint) {
  if (R_posed_current_ && hint.R_last_current)
    *R_posed_current_ *= *hint.R_last_current;
  else
    R_posed_current_.reset();
}

GravityUse TrackerInertia::weigh(const SE3& T_odom_camera_guess, const MotionHint& hint,
                                 TrackerFrame& frame) const {
  if (hint.up_camera && up_odom_) {
    frame.up = UpPrior{*up_odom_, *hint.up_camera, gravity_sigma_rad_};
    return GravityUse::kUsed;
  }
  if (!hint.force_camera_m_s2) return GravityUse::kNone;
  const auto answer = gravity_.observe(frame.frame->stamp, T_odom_camera_guess, *hint.force_camera_m_s2);
  if (answer.verdict == GravityEstimator::Verdict::kTooEarly) return GravityUse::kNone;
  if (answer.verdict == GravityEstimator::Verdict::kRejected) return GravityUse::kRejected;
  frame.up = answer.up;
  frame.up->sigma_rad = std::hypot(gravity_sigma_rad_, answer.up.sigma_rad);
  return GravityUse::kUsed;
}

void TrackerInertia::end_frame(Time stamp, const MotionHint& hint, TrackingStatus status,
                               const SE3& T_odom_camera) {
  if (status != TrackingStatus::kTracked || !hint.force_camera_m_s2) gravity_.interrupt();
  if (status == TrackingStatus::kStarted) gravity_.reset();
  if (status == TrackingStatus::kLost || status == TrackingStatus::kSkipped) return;
  R_posed_current_ = Mat3::Identity();
  if (hint.up_camera && !up_odom_) up_odom_ = T_odom_camera.rotation() * *hint.up_camera;
  gravity_.add(stamp, T_odom_camera, hint.force_camera_m_s2.value_or(Vec3::Zero()));
}

}  // namespace hm
