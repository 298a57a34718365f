#include "hm/estimation/decoupled_kalman.hpp"

#include <cmath>
#include <numbers>

#include "hm/core/check.hpp"

namespace hm {
namespace {

constexpr double kTurn_rad = 2.0 * std::numbers::pi;

double in_one_turn(double angle_rad) {
  const double wrapped = angle_rad - kTurn_rad * std::floor(angle_rad / kTurn_rad);
  return wrapped < kTurn_rad ? wrapped : 0.0;  // a tiny negative angle rounds up to a whole turn
}

}  // namespace

DecoupledKalmanParams DecoupledKalmanParams::city_flyer() {
  DecoupledKalmanParams params;
  params.x = params.y = {0.083, 2.0, 2.0};
  params.z = {100.0, 0.001, 2000.0};  // as it ran: the noise of the climb rate was the one latched at reset
  return params;
}

void AxisKalman::reset(const Vec2& state) {
  state_ = state;
  covariance_.setIdentity();
  gain_.setZero();
}

void AxisKalman::predict(double acceleration_m_s2, double dt_s, const AxisNoise& noise) {
  HM_CHECK(dt_s > 0 && std::isfinite(acceleration_m_s2), "dt {} s, acceleration {}", dt_s, acceleration_m_s2);
  Mat2 a;
  a << 1, dt_s, 0, 1;                           // (2.15)
  const Vec2 b(0.5 * dt_s * dt_s, dt_s);        // (2.15)
  state_ = a * state_ + b * acceleration_m_s2;  // (2.13)
  covariance_ = a * covariance_ * a.transpose();
  covariance_.diagonal().array() += noise.q;
}

void AxisKalman::correct(const Vec2& measured, const AxisNoise& noise) {
  HM_CHECK(measured.allFinite(), "measurement is not finite");
  const Vec2 r(noise.r_position, noise.r_velocity);
  const Mat2 innovation_covariance = covariance_ + Mat2(r.asDiagonal());  // H = I (2.14)
  gain_ = covariance_ * innovation_covariance.inverse();
  state_ += gain_ * (measured - state_);
  const Mat2 rest = Mat2::Identity() - gain_;
  covariance_ = rest * covariance_ * rest.transpose() + gain_ * r.asDiagonal() * gain_.transpose();
}

void YawKalman::reset(double yaw_rad) {
  yaw_rad_ = in_one_turn(yaw_rad);
  variance_ = 1;
  gain_ = 0;
}

void YawKalman::predict(double yaw_rate_rad_s, double dt_s, double q) {
  HM_CHECK(dt_s > 0 && std::isfinite(yaw_rate_rad_s), "dt {} s, rate {}", dt_s, yaw_rate_rad_s);
  yaw_rad_ = in_one_turn(yaw_rad_ + dt_s * yaw_rate_rad_s);  // (2.16)
  variance_ += q;
}

void YawKalman::correct(double measured_yaw_rad, double r) {
  HM_CHECK(std::isfinite(measured_yaw_rad), "measurement is not finite");
  gain_ = variance_ / (variance_ + r);
  yaw_rad_ = in_one_turn(yaw_rad_ + gain_ * wrap_angle(measured_yaw_rad - yaw_rad_));
  variance_ *= 1 - gain_;
}

void DecoupledKalman::reset_planar(const Vec2& position_m, double yaw_rad) {
  x_.reset({position_m.x(), 0});
  y_.reset({position_m.y(), 0});
  yaw_.reset(yaw_rad);
}

void DecoupledKalman::reset_height(double height_m) { z_.reset({height_m, 0}); }

void DecoupledKalman::predict(const Vec3& acceleration_world_m_s2, double yaw_rate_rad_s, double dt_s) {
  x_.predict(acceleration_world_m_s2.x(), dt_s, params_.x);
  y_.predict(acceleration_world_m_s2.y(), dt_s, params_.y);
  z_.predict(acceleration_world_m_s2.z(), dt_s, params_.z);
  yaw_.predict(yaw_rate_rad_s, dt_s, params_.q_yaw);
}

void DecoupledKalman::correct_planar(const Vec2& position_m, const Vec2& velocity_m_s, double yaw_rad) {
  x_.correct({position_m.x(), velocity_m_s.x()}, params_.x);
  y_.correct({position_m.y(), velocity_m_s.y()}, params_.y);
  yaw_.correct(yaw_rad, params_.r_yaw);
}

void DecoupledKalman::correct_height(double height_m, double climb_m_s) {
  z_.correct({height_m, climb_m_s}, params_.z);
}

}  // namespace hm
