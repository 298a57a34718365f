#include "hm/control/attitude_controller.hpp"

#include <cmath>

namespace hm {
namespace {
/// Braking that large tilt errors are reduced with: about half of what the rotors give in hover.
constexpr float kTiltAcceleration_rad_s2 = 80;
/// Counter torque per measured acceleration of roll and pitch: damps what the rotors' delay excites.
constexpr float kDampingRatio = 0.8F;
/// Cut-off frequency of that acceleration: below the vibration of the rotors.
constexpr float kDampingCutoff_hz = 40;
/// Integrals of the rates are limited to this angular acceleration.
constexpr float kMaxIntegral_rad_s2 = 15;
/// Time constant with which saturation unloads them.
constexpr float kAntiWindup_s = 0.2F;
}  // namespace

TiltYawError tilt_yaw_error(const Attitude& wanted, const Attitude& measured) {
  // error = tilt * yaw with tilt = (w, x, y, 0), yaw = (cos, 0, 0, sin) of half the angle
  Attitude e = measured.inverse() * wanted;
  if (e.w < 0) e = {-e.w, -e.x, -e.y, -e.z};
  const float length = norm_f(e.w, e.z);
  if (length < 1e-6F) return {Vec3f(kPiF * e.x, kPiF * e.y, 0), 0};  // upside down: yaw has no meaning
  const float c = e.w / length, s = e.z / length;
  const float x = c * e.x + s * -e.y, y = c * e.y + s * e.x;  // tilt = error * yaw^-1; its w is `length`
  const float half_sine = norm_f(x, y);
  const float angle = 2 * atan2_f(half_sine, length);
  const float scale = half_sine > 1e-4F ? angle / half_sine : 2;
  return {Vec3f(scale * x, scale * y, 0), 2 * atan2_f(s, c)};
}

AttitudeController::AttitudeController(const AttitudeParams& params, const QuadrotorModel& model,
                                       float step_s)
    : params_(params),
      step_s_(step_s),
      inertia_(model.inertia_xy_kg_m2, model.inertia_xy_kg_m2, model.inertia_z_kg_m2),
      gains_(params.rate_xy_per_s, params.rate_xy_per_s, params.rate_z_per_s),
      damping_(kDampingRatio, kDampingRatio, 0),
      low_pass_(kDampingCutoff_hz, step_s) {}

void AttitudeController::reset() {
  low_pass_.reset();
  started_ = false;
  error_ = integral_ = torque_ = Vec3f::Zero();
}

Vec3f AttitudeController::wanted_rates(const Attitude& wanted, const Attitude& measured,
                                       float yaw_rate_rad_s) const {
  const AttitudeParams& p = params_;
  const TiltYawError error = tilt_yaw_error(wanted, measured);
  const float angle = norm_f(error.tilt_rad);
  const float linear = kTiltAcceleration_rad_s2 / (p.tilt_per_s * p.tilt_per_s);
  float rate = p.tilt_per_s * angle;
  if (angle > linear) rate = std::sqrt(2 * kTiltAcceleration_rad_s2 * (angle - 0.5F * linear));
  rate = min_f(rate, p.tilt_rate_rad_s);
  const float scale = angle > 1e-6F ? rate / angle : p.tilt_per_s;
  Vec3f rates = scale * error.tilt_rad + measured.rotate_back(Vec3f(0, 0, yaw_rate_rad_s));
  rates.z() = clamp_f(rates.z() + p.yaw_per_s * error.yaw_rad, -p.kMaxYawRate_rad_s, p.kMaxYawRate_rad_s);
  return rates;
}

const Vec3f& AttitudeController::step(const Vec3f& wanted_rates_rad_s, const Vec3f& rates_rad_s) {
  const Vec3f before = started_ ? low_pass_.value() : rates_rad_s;
  started_ = true;
  const Vec3f acceleration = (low_pass_.step(rates_rad_s) - before) / step_s_;
  error_ = wanted_rates_rad_s - rates_rad_s;
  const Vec3f wanted = gains_.cwiseProduct(error_) + integral_ - damping_.cwiseProduct(acceleration);
  torque_ = inertia_.cwiseProduct(wanted) + cross_f(rates_rad_s, inertia_.cwiseProduct(rates_rad_s));
  return torque_;
}

void AttitudeController::applied(const Vec3f& torque_n_m) {
  for (int i = 0; i < 3; ++i) {
    const float missing = (torque_n_m[i] - torque_[i]) / (inertia_[i] * kAntiWindup_s);
    const bool unloads = missing * integral_[i] < 0;
    const float rate = params_.rate_integral_per_s * gains_[i] * error_[i] + (unloads ? missing : 0);
    integral_[i] = clamp_f(integral_[i] + step_s_ * rate, -kMaxIntegral_rad_s2, kMaxIntegral_rad_s2);
  }
}

}  // namespace hm
