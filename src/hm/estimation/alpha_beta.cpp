#include "hm/estimation/alpha_beta.hpp"

#include <cmath>

namespace hm {

template <class Scalar>
AlphaBetaStatus BasicAlphaBetaAngle<Scalar>::update(Time time, Scalar measured_rad) {
  if (!std::isfinite(measured_rad)) return AlphaBetaStatus::kInvalid;
  const Duration since_last = time - time_;
  const auto status = detail::alpha_beta_step(started_, since_last, params_.max_gap_s);
  if (status == AlphaBetaStatus::kTimeBackwards) return status;
  time_ = time;
  started_ = true;
  if (status != AlphaBetaStatus::kUpdated) {
    angle_rad_ = wrap_angle(measured_rad);
    rate_rad_s_ = 0;
    return status;
  }
  const Scalar dt_s = seconds_of<Scalar>(since_last);
  const Scalar predicted = angle_rad_ + dt_s * rate_rad_s_;
  const Scalar residual = wrap_angle(measured_rad - predicted);
  angle_rad_ = wrap_angle(predicted + params_.alpha_ratio * residual);  // (2.7)
  rate_rad_s_ += params_.beta_ratio / dt_s * residual;                  // (2.8)
  return status;
}

template class BasicAlphaBetaAngle<double>;
template class BasicAlphaBetaAngle<float>;

Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& rotation) {
  const double sign = rotation.w() < 0 ? -1 : 1;
  const Eigen::Vector3d v = sign * rotation.vec();
  const double sine = v.norm();
  if (sine < 1e-9) return 2.0 * v;
  return (2.0 * std::atan2(sine, sign * rotation.w()) / sine) * v;
}

AlphaBetaStatus AlphaBetaOrientation::update(Time time, const Eigen::Quaterniond& measured_R_world_body) {
  const double length = measured_R_world_body.norm();
  if (!std::isfinite(length) || length < 1e-9) return AlphaBetaStatus::kInvalid;
  const Duration since_last = time - time_;
  const auto status = detail::alpha_beta_step(started_, since_last, params_.max_gap_s);
  if (status == AlphaBetaStatus::kTimeBackwards) return status;
  time_ = time;
  started_ = true;
  const Eigen::Quaterniond measured = measured_R_world_body.normalized();
  if (status != AlphaBetaStatus::kUpdated) {
    R_world_body_ = measured;
    rate_body_rad_s_.setZero();
    return status;
  }
  const double dt_s = since_last.seconds();
  const Eigen::Quaterniond predicted = turned(R_world_body_, dt_s * rate_body_rad_s_);
  const Eigen::Vector3d residual = rotation_vector(predicted.conjugate() * measured);
  R_world_body_ = turned(predicted, params_.alpha_ratio * residual);  // (2.7)
  rate_body_rad_s_ += params_.beta_ratio / dt_s * residual;           // (2.8)
  return status;
}

}  // namespace hm
