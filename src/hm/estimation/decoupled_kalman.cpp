#include "hm/estimation/decoupled_kalman.hpp"

#include <Eigen/LU>
#include <cmath>
#include <numbers>

namespace hm {
namespace {

template <class Scalar>
Scalar in_one_turn(Scalar angle_rad) {
  constexpr Scalar kTurn_rad = 2 * std::numbers::pi_v<Scalar>;
  const Scalar wrapped = angle_rad - kTurn_rad * std::floor(angle_rad / kTurn_rad);
  return wrapped < kTurn_rad ? wrapped : 0;  // a tiny negative angle rounds up to a whole turn
}

}  // namespace

template <class Scalar>
BasicDecoupledKalmanParams<Scalar> BasicDecoupledKalmanParams<Scalar>::city_flyer() {
  BasicDecoupledKalmanParams params;
  params.x = params.y = {Scalar(0.083), Scalar(2.0), Scalar(2.0)};
  params.z = {Scalar(100.0), Scalar(0.001),
              Scalar(2000.0)};  // as it ran: the noise of the climb rate was the one latched at reset
  return params;
}

template <class Scalar>
void BasicAxisKalman<Scalar>::reset(const Vector& state) {
  state_ = state;
  covariance_.setIdentity();
  gain_.setZero();
}

template <class Scalar>
void BasicAxisKalman<Scalar>::predict(Scalar acceleration_m_s2, Scalar dt_s, const Noise& noise) {
  if (!(dt_s > 0) || !std::isfinite(acceleration_m_s2)) return;
  Matrix a;
  a << 1, dt_s, 0, 1;                               // (2.15)
  const Vector b(Scalar(0.5) * dt_s * dt_s, dt_s);  // (2.15)
  state_ = a * state_ + b * acceleration_m_s2;      // (2.13)
  covariance_ = a * covariance_ * a.transpose();
  covariance_.diagonal().array() += noise.q;
}

template <class Scalar>
void BasicAxisKalman<Scalar>::correct(const Vector& measured, const Noise& noise) {
  if (!measured.allFinite()) return;
  const Vector r(noise.r_position, noise.r_velocity);
  const Matrix innovation_covariance = covariance_ + Matrix(r.asDiagonal());  // H = I (2.14)
  gain_ = covariance_ * innovation_covariance.inverse();
  state_ += gain_ * (measured - state_);
  const Matrix rest = Matrix::Identity() - gain_;
  covariance_ = rest * covariance_ * rest.transpose() + gain_ * r.asDiagonal() * gain_.transpose();
}

template <class Scalar>
void BasicYawKalman<Scalar>::reset(Scalar yaw_rad) {
  yaw_rad_ = in_one_turn(yaw_rad);
  variance_ = 1;
  gain_ = 0;
}

template <class Scalar>
void BasicYawKalman<Scalar>::predict(Scalar yaw_rate_rad_s, Scalar dt_s, Scalar q) {
  if (!(dt_s > 0) || !std::isfinite(yaw_rate_rad_s)) return;
  yaw_rad_ = in_one_turn(yaw_rad_ + dt_s * yaw_rate_rad_s);  // (2.16)
  variance_ += q;
}

template <class Scalar>
void BasicYawKalman<Scalar>::correct(Scalar measured_yaw_rad, Scalar r) {
  if (!std::isfinite(measured_yaw_rad)) return;
  gain_ = variance_ / (variance_ + r);
  yaw_rad_ = in_one_turn(yaw_rad_ + gain_ * wrap_angle(measured_yaw_rad - yaw_rad_));
  variance_ *= 1 - gain_;
}

template <class Scalar>
void BasicDecoupledKalman<Scalar>::reset_planar(const Vector2& position_m, Scalar yaw_rad) {
  x_.reset({position_m.x(), 0});
  y_.reset({position_m.y(), 0});
  yaw_.reset(yaw_rad);
}

template <class Scalar>
void BasicDecoupledKalman<Scalar>::reset_height(Scalar height_m) {
  z_.reset({height_m, 0});
}

template <class Scalar>
void BasicDecoupledKalman<Scalar>::predict(const Vector3& acceleration_world_m_s2, Scalar yaw_rate_rad_s,
                                           Scalar dt_s) {
  x_.predict(acceleration_world_m_s2.x(), dt_s, params_.x);
  y_.predict(acceleration_world_m_s2.y(), dt_s, params_.y);
  z_.predict(acceleration_world_m_s2.z(), dt_s, params_.z);
  yaw_.predict(yaw_rate_rad_s, dt_s, params_.q_yaw);
}

template <class Scalar>
void BasicDecoupledKalman<Scalar>::correct_planar(const Vector2& position_m, const Vector2& velocity_m_s,
                                                  Scalar yaw_rad) {
  x_.correct({position_m.x(), velocity_m_s.x()}, params_.x);
  y_.correct({position_m.y(), velocity_m_s.y()}, params_.y);
  yaw_.correct(yaw_rad, params_.r_yaw);
}

template <class Scalar>
void BasicDecoupledKalman<Scalar>::correct_height(Scalar height_m, Scalar climb_m_s) {
  z_.correct({height_m, climb_m_s}, params_.z);
}

template struct BasicDecoupledKalmanParams<double>;
template struct BasicDecoupledKalmanParams<float>;
template class BasicAxisKalman<double>;
template class BasicAxisKalman<float>;
template class BasicYawKalman<double>;
template class BasicYawKalman<float>;
template class BasicDecoupledKalman<double>;
template class BasicDecoupledKalman<float>;

}  // namespace hm
