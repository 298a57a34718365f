#include "hm/control/published_controller.hpp"

#include <cmath>

namespace hm {
namespace {

bool all_finite(const RpytCommand& command) {
  return std::isfinite(command.roll_rad) && std::isfinite(command.pitch_rad) &&
         std::isfinite(command.yaw_rate_rad_s) && std::isfinite(command.thrust_ratio);
}

bool all_finite(const ControlState& state, const PublishedCommand& command) {
  return is_finite_f(state.position_m) && is_finite_f(state.velocity_m_s) && is_unit(state.attitude) &&
         is_finite_f(state.rates_rad_s) && is_finite_f(command.goal.position_m) &&
         is_finite_f(command.goal.velocity_m_s) && std::isfinite(command.goal.yaw_rad) &&
         std::isfinite(command.goal.yaw_rate_rad_s) && all_finite(command.direct) &&
         all_finite(command.manual);
}

/// Gains of a law in a mode.
const PiDGains& gains_in(AxisMode mode, const PiDGains& position, const PiDGains& velocity) {
  return mode == AxisMode::kPosition ? position : velocity;
}

}  // namespace

PiD::PiD(const PiDGains& gains, float step_s) : step_s_(step_s), fade_(1 - step_s / kFade_s) {
  change_gains(gains);
}

void PiD::change_gains(const PiDGains& gains) {
  gains_ = gains;
  log_base_ = log_f(gains.d_base);
}

void PiD::reset() {
  integral_ = error_ = output_ = offset_ = start_ = 0;
  starting_ = false;
}

float PiD::damping(float error) const { return gains_.kd * exp_f(-log_base_ * (error < 0 ? -error : error)); }

float PiD::step(float error, float velocity) {
  error_ = clamp_f(error, -gains_.max_error, gains_.max_error);
  const float law = gains_.bias + gains_.kp * error_ - damping(error_) * velocity;
  if (starting_) {
    if (gains_.ki > 0)
      integral_ = clamp_f((start_ - law) / gains_.ki, -gains_.max_integral, gains_.max_integral);
    offset_ = start_ - law - gains_.ki * integral_;
    starting_ = false;
  } else {
    offset_ *= fade_;
  }
  output_ = law + gains_.ki * integral_ + offset_;
  return output_;
}

void PiD::applied(float output) {
  const float beyond = output_ - output;
  if (beyond * error_ > 0) return;
  integral_ = clamp_f(integral_ + step_s_ * error_, -gains_.max_integral, gains_.max_integral);
}

void PiD::continue_from(float output) {
  start_ = output;
  starting_ = true;
}

PublishedModes published_velocity_modes() {
  return {AxisMode::kVelocity, AxisMode::kVelocity, AxisMode::kPosition, AxisMode::kVelocity};
}

void PublishedController::Axis::change_mode(AxisMode now, const PiDGains& gains, float output) {
  if (now == mode) return;
  mode = now;
  if (!has_law()) return;
  law.change_gains(gains);
  law.continue_from(output);
}

PublishedController::PublishedController(const PublishedControlParams& params, float step_s)
    : params_(params),
      step_s_(step_s),
      x_{{params.position_xy, step_s}},
      y_{{params.position_xy, step_s}},
      z_{{params.position_z, step_s}},
      yaw_{{params.yaw, step_s}} {}

void PublishedController::reset() {
  for (Axis* axis : {&x_, &y_, &z_, &yaw_}) axis->law.reset();
  start_from({});
}

void PublishedController::start_from(const RpytCommand& current) {
  if (!all_finite(current)) {
    ++bad_inputs_;
    return;
  }
  for (Axis* axis : {&x_, &y_, &z_, &yaw_}) axis->mode = AxisMode::kDisabled;
  output_ = current;
  roll_.start_from(current.roll_rad);
  pitch_.start_from(current.pitch_rad);
  yaw_rate_.start_from(current.yaw_rate_rad_s);
  thrust_percent_.start_from(100 * current.thrust_ratio);
}

std::array<float, 4> PublishedController::integrals() const {
  return {x_.law.integral(), y_.law.integral(), z_.law.integral(), yaw_.law.integral()};
}

void PublishedController::change_modes(const PublishedModes& modes) {
  const PublishedControlParams& p = params_;
  x_.change_mode(modes.x, gains_in(modes.x, p.position_xy, p.velocity_x), output_.pitch_rad);
  y_.change_mode(modes.y, gains_in(modes.y, p.position_xy, p.velocity_y), -output_.roll_rad);
  z_.change_mode(modes.z, gains_in(modes.z, p.position_z, p.velocity_z), thrust_percent_.value());
  yaw_.change_mode(modes.yaw, p.yaw, output_.yaw_rate_rad_s);
}

RpytCommand PublishedController::wanted(const ControlState& state, const PublishedCommand& command) {
  const float yaw = euler_angles(state.attitude).yaw_rad;
  const auto [sine, cosine] = sin_cos_f(yaw);
  const auto level = [&](const Vec3f& v) {  // turned into the level base frame
    return Vec3f(cosine * v.x() + sine * v.y(), cosine * v.y() - sine * v.x(), v.z());
  };
  const Vec3f position_error = level(command.goal.position_m - state.position_m);
  const Vec3f velocity = level(state.velocity_m_s);
  const Vec3f velocity_error = command.goal.velocity_m_s - velocity;
  const auto output = [&](Axis& axis, int i, float passed) {
    if (!axis.has_law()) return passed;
    const bool position = axis.mode == AxisMode::kPosition;
    return axis.law.step(position ? position_error[i] : velocity_error[i], position ? velocity[i] : 0);
  };
  const auto passed = [&](const Axis& axis) -> const RpytCommand& {
    return axis.mode == AxisMode::kDirect ? command.direct : command.manual;
  };
  RpytCommand wanted;
  wanted.pitch_rad = output(x_, 0, passed(x_).pitch_rad);
  wanted.roll_rad = -output(y_, 1, -passed(y_).roll_rad);
  wanted.thrust_ratio = 0.01F * output(z_, 2, 100 * passed(z_).thrust_ratio);
  wanted.yaw_rate_rad_s = command.goal.yaw_rate_rad_s;  // kVelocity passes it through
  if (yaw_.mode == AxisMode::kPosition)
    wanted.yaw_rate_rad_s = yaw_.law.step(wrap_angle_f(command.goal.yaw_rad - yaw), state.rates_rad_s.z());
  if (!yaw_.has_law()) wanted.yaw_rate_rad_s = passed(yaw_).yaw_rate_rad_s;
  return wanted;
}

void PublishedController::limit(const RpytCommand& wanted) {
  const PublishedControlParams& p = params_;
  output_.roll_rad =
      roll_.step(clamp_f(wanted.roll_rad, -p.tilt_rad, p.tilt_rad), p.roll_slew_rad_s, step_s_);
  output_.pitch_rad =
      pitch_.step(clamp_f(wanted.pitch_rad, -p.tilt_rad, p.tilt_rad), p.pitch_slew_rad_s, step_s_);
  output_.yaw_rate_rad_s = yaw_rate_.step(clamp_f(wanted.yaw_rate_rad_s, -p.yaw_rate_rad_s, p.yaw_rate_rad_s),
                                          p.yaw_slew_rad_s2, step_s_);
  output_.thrust_ratio = 0.01F * thrust_percent_.step(clamp_f(100 * wanted.thrust_ratio, 0, p.thrust_percent),
                                                      p.thrust_slew_percent_s, step_s_);
}

const RpytCommand& PublishedController::step(const ControlState& state, const PublishedCommand& command) {
  if (!all_finite(state, command)) {
    ++bad_inputs_;
    return output_;
  }
  change_modes(command.modes);
  limit(wanted(state, command));
  const auto learn = [](Axis& axis, float output) {
    if (axis.has_law()) axis.law.applied(output);
  };
  learn(x_, output_.pitch_rad);
  learn(y_, -output_.roll_rad);
  learn(z_, thrust_percent_.value());
  if (yaw_.mode == AxisMode::kPosition) learn(yaw_, output_.yaw_rate_rad_s);
  return output_;
}

CascadeCommand flown_by(PublishedController& controller, const ControlState& state,
                        const CascadeCommand& command) {
  const FlightModes& modes = command.modes;
  if (modes.vertical == AxisMode::kDisabled) {
    controller.reset();
    return command;
  }
  PublishedCommand published;
  published.modes = {modes.horizontal, modes.horizontal, modes.vertical, modes.heading};
  published.goal = command.goal;
  published.direct = command.direct;
  const SinCos turn = sin_cos_f(euler_angles(state.attitude).yaw_rad);
  const Vec3f& v = command.goal.velocity_m_s;
  published.goal.velocity_m_s = {turn.cos * v.x() + turn.sin * v.y(), turn.cos * v.y() - turn.sin * v.x(),
                                 v.z()};
  CascadeCommand direct = command;
  direct.modes = {AxisMode::kDirect, AxisMode::kDirect, AxisMode::kDirect};
  direct.direct = controller.step(state, published);
  return direct;
}

}  // namespace hm
