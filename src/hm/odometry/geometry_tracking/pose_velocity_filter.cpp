#include "hm/odometry/geometry_tracking/pose_velocity_filter.hpp"

#include <algorithm>

#include "hm/geometry/solvers/small_solvers.hpp"
#include "hm/odometry/registration/pose_equations.hpp"

namespace hm {
namespace {

// Spectral density of the acceleration of a hand-held camera. Extrapolating true poses at constant velocity
// over one to three frames in the tuning halves errs as if it were 0.5 to 0.9 and 0.5 to 1.0 (sevenscenes_a),
// 0.3 to 0.5 and 1.1 to 1.9 (tum_fr1_xyz), 0.1 to 0.2 and 1.6 to 2.3 (tum_fr1_rpy).
constexpr double kAcceleration = 0.5;  // m s^-1.5
constexpr double kAngularAccel = 2.0;  // rad s^-1.5
constexpr double kStartSigma_m = 0.001, kStartSigma_rad = 0.001;
constexpr double kKnownSpeed_m_s = 0.1, kKnownTurn_rad_s = 0.15;  // a velocity from two poses
constexpr double kAnySpeed_m_s = 0.5, kAnyTurn_rad_s = 1.0;       // of a hand-held camera
constexpr double kMaxExtrapolated_s = 0.5;
constexpr double kGyroSigma_rad_s = 0.05;

Vec6 squares(double translation, double rotation) {
  Vec6 values;
  values << Vec3::Constant(translation * translation), Vec3::Constant(rotation * rotation);
  return values;
}

}  // namespace

PoseVelocityFilter::PoseVelocityFilter(const SE3& T_odom_camera, const std::optional<Vec6>& twist_s)
    : T_odom_camera_(T_odom_camera), twist_s_(twist_s.value_or(Vec6::Zero())) {
  covariance_.diagonal() << squares(kStartSigma_m, kStartSigma_rad),
      twist_s ? squares(kKnownSpeed_m_s, kKnownTurn_rad_s) : squares(kAnySpeed_m_s, kAnyTurn_rad_s);
}

PoseVelocityFilter::Forecast PoseVelocityFilter::forecast(double duration_s,
                                                          const std::optional<Mat3>& R_last_current) const {
  const double dt = duration_s;
  SE3 motion = SE3::exp(twist_s_ * std::min(dt, kMaxExtrapolated_s));
  if (R_last_current) motion = SE3(*R_last_current, motion.translation());
  Mat12 transition = Mat12::Identity();
  transition.topLeftCorner<6, 6>() = adjoint(motion.inverse());
  transition.topRightCorner<6, 6>() = dt * Mat6::Identity();
  // With a gyroscope the rotation does not depend on the velocity before.
  if (R_last_current) transition.block<3, 3>(3, 9).setZero();
  Forecast out{T_odom_camera_ * motion, transition * covariance_ * transition.transpose()};
  const Vec6 density = squares(kAcceleration, kAngularAccel);
  Vec6 by_pose = density * (dt * dt * dt / 3), across = density * (dt * dt / 2);
  if (R_last_current) {
    by_pose.tail<3>().setConstant(kGyroSigma_rad_s * kGyroSigma_rad_s * dt * dt);
    across.tail<3>().setZero();
  }
  out.covariance.topLeftCorner<6, 6>().diagonal() += by_pose;
  out.covariance.topRightCorner<6, 6>().diagonal() += across;
  out.covariance.bottomLeftCorner<6, 6>().diagonal() += across;
  out.covariance.bottomRightCorner<6, 6>().diagonal() += density * dt;
  return out;
}

PoseVelocityFilter::Prediction PoseVelocityFilter::predict(double duration_s,
                                                           const std::optional<Mat3>& R_last_current) const {
  const Forecast ahead = forecast(duration_s, R_last_current);
  return {ahead.T_odom_camera, ahead.covariance.topLeftCorner<6, 6>()};
}

void PoseVelocityFilter::update(double duration_s, const std::optional<Mat3>& R_last_current,
                                const SE3& T_odom_camera, const Mat6& information) {
  const Forecast ahead = forecast(duration_s, R_last_current);
  const Mat6 prior = inverse_of(ahead.covariance.topLeftCorner<6, 6>());
  const Mat6 after = inverse_of(prior + information);
  const Eigen::Matrix<double, 12, 6> by_pose = ahead.covariance.leftCols<6>();
  const Vec6 innovation = (ahead.T_odom_camera.inverse() * T_odom_camera).log();
  twist_s_ += by_pose.bottomRows<6>() * prior * innovation;
  covariance_ = ahead.covariance - by_pose * (prior - prior * after * prior) * by_pose.transpose();
  covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();
  T_odom_camera_ = T_odom_camera;
}

}  // namespace hm
