#include "hm/odometry/tracker/tracker_inertia.hpp"

#include <algorithm>
#include <cmath>

#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

// A registration is far from the prediction beyond both; chi-squared, six degrees of freedom, 99 %, thrice.
constexpr double kFarSquared = 3 * 16.81, kNear_m = 0.05, kNear_rad = 0.05;
// So many landmarks that agree outweigh the readings: the device may have been knocked.
constexpr int kSureInliers = 50;
constexpr int kMaxBridged = 5;  // in a row; then images are preferred to the prediction
constexpr double kLeastScale = 0.75;
constexpr double kExact = 1e-3;  // metres and radians
constexpr double kNothing = 1;   // information, 1/m^2 and 1/rad^2

/// A pose that the model is made to fit.
VisualPose exactly(const SE3& T_odom_camera) {
  return {T_odom_camera, Mat6::Identity() / (kExact * kExact), Vec6::Zero()};
}

/// Covariance of a pose by the inverse of its information: a few residuals may be small by chance.
double image_scale(const Registration& registration) {
  return std::max(kLeastScale, covariance_scale(registration));
}

/// Registered pose by the images alone.
VisualPose by_images(const Registration& registration) {
  const double scale = image_scale(registration);
  return {registration.T_odom_camera, (registration.information - registration.by_prior.information) / scale,
          -registration.by_prior.gradient / scale};
}

}  // namespace

void TrackerInertia::begin_frame(const MotionHint& hint) {
  if (R_posed_current_ && hint.R_last_current)
    *R_posed_current_ *= *hint.R_last_current;
  else
    R_posed_current_.reset();
  tracking_.feed(hint.readings);
}

std::optional<InertialPrediction> TrackerInertia::predict(TrackerFrame& frame) const {
  const auto prediction = tracking_.predict(frame.frame->stamp);
  if (prediction)
    frame.prior = PosePrior{prediction->state.T_odom_camera,
                            scale_ * inverse_of(prediction->pose_covariance()), scale_};
  return prediction;
}

bool TrackerInertia::contradicts(const InertialPrediction& prediction,
                                 const Registration& registration) const {
  return bridged_ < kMaxBridged && registration.inliers < kSureInliers && is_far(prediction, registration);
}

bool TrackerInertia::is_far(const InertialPrediction& prediction, const Registration& registration) {
  const Vec6 d = (prediction.state.T_odom_camera.inverse() * registration.T_odom_camera).log();
  if (d.head<3>().norm() < kNear_m && d.tail<3>().norm() < kNear_rad) return false;
  return d.dot(inverse_of(prediction.pose_covariance()) * d) > kFarSquared;
}

void TrackerInertia::accept(const TrackerFrame& frame, const Registration& registration,
                            TrackingStatus status, const SE3& T_by_velocity) {
  bridged_ = status == TrackingStatus::kBridged ? bridged_ + 1 : 0;
  if (status == TrackingStatus::kTracked) scale_ = image_scale(registration);
  if (tracking_.use() == InertialUse::kNone) return;
  const VisualPose pose = by_images(registration);
  if (status == TrackingStatus::kRelocalised)
    tracking_.continue_from(frame.frame->stamp, pose, nullptr);
  else if (status == TrackingStatus::kTracked || !pose.information.isZero(kNothing))
    tracking_.add(frame.frame->stamp, pose, T_by_velocity);
}

std::optional<GyroTurn> TrackerInertia::turn(Time begin, Time end) const {
  auto turn = tracking_.turn(begin, end);
  if (turn) turn->covariance /= scale_;
  return turn;
}

void TrackerInertia::begin_model(const TrackerFrame& frame, const SE3& T_odom_camera,
                                 const InertialPrediction& prediction) {
  tracking_.continue_from(frame.frame->stamp, exactly(T_odom_camera), &prediction);
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
  if (status == TrackingStatus::kStarted) {
    gravity_.reset();
    tracking_.begin(stamp, exactly(T_odom_camera));
  }
  if (status == TrackingStatus::kLost || status == TrackingStatus::kSkipped) return;
  R_posed_current_ = Mat3::Identity();
  if (hint.up_camera && !up_odom_) up_odom_ = T_odom_camera.rotation() * *hint.up_camera;
  gravity_.add(stamp, T_odom_camera, hint.force_camera_m_s2.value_or(Vec3::Zero()));
}

}  // namespace hm
