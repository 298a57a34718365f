#include "hm/control/cascade.hpp"

#include <cmath>

namespace hm {
namespace {

/// Tilts beyond 60 degrees do not raise the thrust any further.
constexpr float kLeastCosine = 0.5F;

bool follows(AxisMode mode) { return mode == AxisMode::kPosition || mode == AxisMode::kVelocity; }

bool is_good(const ControlState& state) {
  return is_finite_f(state.position_m) && is_finite_f(state.velocity_m_s) && is_finite_f(state.rates_rad_s) &&
         is_unit(state.attitude);
}

bool is_good(const CascadeCommand& command) {
  const MotionGoal& goal = command.goal;
  const RpytCommand& direct = command.direct;
  const FlightLimits& limits = command.limits;
  return is_finite_f(goal.position_m) && is_finite_f(goal.velocity_m_s) && std::isfinite(goal.yaw_rad) &&
         std::isfinite(goal.yaw_rate_rad_s) && std::isfinite(direct.roll_rad) &&
         std::isfinite(direct.pitch_rad) && std::isfinite(direct.yaw_rate_rad_s) &&
         std::isfinite(direct.thrust_ratio) && is_finite_f(command.acceleration_m_s2) &&
         !std::isnan(limits.speed_m_s + limits.climb_m_s + limits.sink_m_s + limits.tilt_rad +
                     limits.thrust_ratio);
}

}  // namespace

Cascade::Cascade(const CascadeParams& params, const QuadrotorModel& model, float step_s)
    : params_(params),
      model_(model),
      step_s_(step_s),
      full_thrust_n_(model.full_thrust_n()),
      shaper_(params.shaper, step_s),
      expected_(params.tilt_response_s, params.thrust_response_s, step_s),
      position_(params.position, step_s),
      attitude_(params.attitude, model, step_s),
      hover_(params.hover, model, step_s),
      mixer_(model) {
  reset();
}

void Cascade::reset() {
  position_.reset();
  attitude_.reset();
  hover_.reset();
  roll_.start_from(0);
  pitch_.start_from(0);
  yaw_rate_.start_from(0);
  thrust_.start_from(0);
  for (SlewLimiter& rotor : rotors_) rotor.start_from(0);
  modes_ = {};
  command_ = {};
  output_ = {};
  // A first set-point starts from hovering; the thrust's slew limit leads there.
  output_.specific_force_m_s2 = Vec3f(0, 0, kGravityF_m_s2);
}

/// Direction in which the rotors lift once the inner loop has followed a command, odom frame.
Vec3f Cascade::direction_of(const RpytCommand& command, float yaw_rad) const {
  const float gain = params_.tilt_gain_ratio;
  return attitude_from({gain * command.roll_rad, gain * command.pitch_rad, yaw_rad}).up_axis();
}

/// Specific force that a command gives the vehicle, odom frame.
Vec3f Cascade::force_of(const RpytCommand& command, float yaw_rad) const {
  const float force = command.thrust_ratio * full_thrust_n_ / hover_.hover_thrust_n() * kGravityF_m_s2;
  return force * direction_of(command, yaw_rad);
}

void Cascade::start_from(const ControlState& state, const RpytCommand& current) {
  if (!is_good(state)) {
    ++bad_states_;
    return;
  }
  roll_.start_from(current.roll_rad);
  pitch_.start_from(current.pitch_rad);
  yaw_rate_.start_from(current.yaw_rate_rad_s);
  thrust_.start_from(current.thrust_ratio);
  const float rotor = mixer_.rotor_speed_rad_s(0.25F * current.thrust_ratio * full_thrust_n_);
  for (SlewLimiter& limiter : rotors_) limiter.start_from(rotor);
  hover_.follow(current.thrust_ratio * full_thrust_n_);
  attitude_.reset();
  modes_ = {};
  output_.rpyt = current;
  output_.specific_force_m_s2 = force_of(current, euler_angles(state.attitude).yaw_rad);
}

/// Axes whose mode is new start from the vehicle's motion and the acceleration that is commanded now: the
/// reference is as far ahead of the vehicle as it expects it to be.
void Cascade::restart_changed_axes(const ControlState& state, float yaw_rad) {
  const FlightModes& now = command_.modes;
  const Vec3f acceleration = output_.specific_force_m_s2 - Vec3f(0, 0, kGravityF_m_s2) -
                             position_.integral_m_s2() -
                             model_.drag_per_s * Vec3f(state.velocity_m_s.x(), state.velocity_m_s.y(), 0);
  Vec3f velocity, position;
  for (int i = 0; i < 3; ++i) {
    velocity[i] = expected_.ahead(i, state.velocity_m_s[i], acceleration[i]);
    position[i] = expected_.ahead(i, state.position_m[i], velocity[i]);
  }
  if (now.horizontal != modes_.horizontal && follows(now.horizontal)) {
    shaper_.start_horizontal_from(position, velocity, acceleration);
    expected_.start(0, shaper_.reference());
    expected_.start(1, shaper_.reference());
  }
  if (now.vertical != modes_.vertical && follows(now.vertical)) {
    shaper_.start_vertical_from(position.z(), velocity.z(), acceleration.z());
    expected_.start(2, shaper_.reference());
  }
  if (now.heading != modes_.heading && follows(now.heading))
    shaper_.start_heading_from(yaw_rad, yaw_rate_.value());
  modes_ = now;
}

const MotionReference& Cascade::refer(const ControlState& state, float yaw_rad) {
  const FlightLimits& limits = command_.limits;
  if (command_.shaped) {
    shaper_.limit_speed(limits.speed_m_s, limits.climb_m_s, limits.sink_m_s);
    return shaper_.step(modes_, command_.goal, state.position_m, yaw_rad);
  }
  const MotionGoal& goal = command_.goal;
  exact_ = {goal.position_m, goal.velocity_m_s, command_.acceleration_m_s2, goal.yaw_rad,
            goal.yaw_rate_rad_s};
  if (modes_.horizontal != AxisMode::kPosition) exact_.position_m.head<2>() = state.position_m.head<2>();
  if (modes_.vertical != AxisMode::kPosition) exact_.position_m.z() = state.position_m.z();
  if (modes_.heading != AxisMode::kPosition) exact_.yaw_rad = yaw_rad;
  shaper_.start_from(exact_);
  return exact_;
}

/// Errors against what the vehicle is expected to have of the reference by now.
PositionErrors Cascade::errors_of(const MotionReference& reference, const ControlState& state) {
  expected_.step(reference);
  const Vec3f position = reference.position_m - state.position_m - expected_.position_lag_m();
  const Vec3f velocity = reference.velocity_m_s - state.velocity_m_s - expected_.velocity_lag_m_s();
  PositionErrors errors;
  if (follows(modes_.horizontal)) {
    if (modes_.horizontal == AxisMode::kPosition) errors.position_m.head<2>() = position.head<2>();
    errors.velocity_m_s.head<2>() = velocity.head<2>();
    errors.feed_forward_m_s2.head<2>() =
        reference.acceleration_m_s2.head<2>() + model_.drag_per_s * reference.velocity_m_s.head<2>();
  }
  if (follows(modes_.vertical)) {
    if (modes_.vertical == AxisMode::kPosition) errors.position_m.z() = position.z();
    errors.velocity_m_s.z() = velocity.z();
    errors.feed_forward_m_s2.z() = reference.acceleration_m_s2.z();
  }
  return errors;
}

Cascade::Wanted Cascade::want(const ControlState& state, float yaw_rad) {
  const MotionReference& reference = refer(state, yaw_rad);
  output_.reference = reference;
  const bool horizontal = follows(modes_.horizontal), vertical = follows(modes_.vertical);
  const PositionErrors errors = errors_of(reference, state);
  const float tilt = clamp_f(command_.limits.tilt_rad, 0, params_.position.tilt_rad);
  Wanted wanted{};
  wanted.specific_force_m_s2 = position_.step(errors, tilt);
  const EulerAngles angles = tilt_towards(wanted.specific_force_m_s2, yaw_rad);
  wanted.roll_rad = horizontal ? angles.roll_rad / params_.tilt_gain_ratio : 0;
  wanted.pitch_rad = horizontal ? angles.pitch_rad / params_.tilt_gain_ratio : 0;
  if (modes_.horizontal == AxisMode::kDirect) {
    const RpytCommand& direct = command_.direct;
    const float length = norm_f(direct.roll_rad, direct.pitch_rad);
    const float share = length > tilt ? tilt / length : 1;
    wanted.roll_rad = share * direct.roll_rad;
    wanted.pitch_rad = share * direct.pitch_rad;
  }
  wanted.thrust_n = command_.direct.thrust_ratio * full_thrust_n_;
  if (vertical)
    wanted.thrust_n = hover_.hover_thrust_n() / kGravityF_m_s2 * wanted.specific_force_m_s2.z() /
                      max_f(kLeastCosine, state.attitude.up_axis().z());
  if (modes_.heading == AxisMode::kDirect) wanted.yaw_rate_rad_s = command_.direct.yaw_rate_rad_s;
  if (follows(modes_.heading))
    wanted.yaw_rate_rad_s =
        reference.yaw_rate_rad_s + params_.attitude.yaw_per_s * wrap_angle_f(reference.yaw_rad - yaw_rad);
  return wanted;
}

/// Limits and slew limits of the inner loop's command.
void Cascade::limit(const Wanted& wanted, float yaw_rad) {
  const float most_yaw = params_.attitude.kMaxYawRate_rad_s;
  const float most_thrust = clamp_f(command_.limits.thrust_ratio, 0, 1);
  RpytCommand& rpyt = output_.rpyt;
  rpyt.roll_rad = roll_.step(wanted.roll_rad, params_.tilt_slew_rad_s, step_s_);
  rpyt.pitch_rad = pitch_.step(wanted.pitch_rad, params_.tilt_slew_rad_s, step_s_);
  rpyt.yaw_rate_rad_s =
      yaw_rate_.step(clamp_f(wanted.yaw_rate_rad_s, -most_yaw, most_yaw), params_.yaw_slew_rad_s2, step_s_);
  rpyt.thrust_ratio = thrust_.step(clamp_f(wanted.thrust_n / full_thrust_n_, 0, most_thrust),
                                   params_.thrust_slew_per_s, step_s_);
  output_.specific_force_m_s2 = force_of(rpyt, yaw_rad);
}

/// Attitude, rates, mixer. Returns the thrust that the rotors are asked for after all limits.
float Cascade::drive_rotors(const ControlState& state, float yaw_rad) {
  const RpytCommand& rpyt = output_.rpyt;
  const Attitude wanted = attitude_from({rpyt.roll_rad, rpyt.pitch_rad, yaw_rad});
  const Vec3f rates = attitude_.wanted_rates(wanted, state.attitude, rpyt.yaw_rate_rad_s);
  const Vec3f torque = attitude_.step(rates, state.rates_rad_s);
  MixerResult mixed = mixer_.mix({rpyt.thrust_ratio * full_thrust_n_, torque,
                                  clamp_f(command_.limits.thrust_ratio, 0, 1) * full_thrust_n_});
  output_.tilt_limited = mixed.tilt_limited;
  output_.thrust_limited = mixed.thrust_limited;
  output_.yaw_limited = mixed.yaw_limited;
  for (std::size_t i = 0; i < 4; ++i) {
    const float speed = rotors_[i].step(mixer_.rotor_speed_rad_s(mixed.rotor_thrust_n[i]),
                                        params_.rotor_slew_rad_s2, step_s_);
    output_.rotor_speed_rad_s[i] = speed;
    mixed.rotor_thrust_n[i] = model_.rotor_thrust_n(speed);
    output_.rotor_thrust_ratio[i] = mixed.rotor_thrust_n[i] / mixer_.max_rotor_thrust_n();
  }
  const MixerResult given = mixer_.result_of(mixed.rotor_thrust_n);
  if (state.airborne) attitude_.applied(given.torque_n_m);
  return given.thrust_n;
}

void Cascade::stop_rotors() {
  for (SlewLimiter& rotor : rotors_) rotor.start_from(0);
  thrust_.start_from(0);
  output_.rpyt = {};
  output_.rotor_speed_rad_s = {};
  output_.rotor_thrust_ratio = {};
  output_.specific_force_m_s2 = Vec3f(0, 0, kGravityF_m_s2);
  output_.tilt_limited = output_.thrust_limited = output_.yaw_limited = false;
  hover_.follow(0);
  attitude_.reset();
  position_.reset();
}

/// Integrals and the hover thrust, from what was really commanded.
void Cascade::learn(const ControlState& state, const Wanted& wanted, float yaw_rad, float thrust_n) {
  if (!state.airborne) return hover_.follow(thrust_n);
  // The specific force that was wanted, as far as direction and thrust came through.
  const float share = wanted.thrust_n > 1e-3F ? thrust_n / wanted.thrust_n : 1;
  const float wanted_force = norm_f(wanted.specific_force_m_s2);
  const Vec3f given =
      (follows(modes_.vertical) ? share : 1) * wanted_force * direction_of(output_.rpyt, yaw_rad);
  position_.applied(given, follows(modes_.horizontal), follows(modes_.vertical));
  if (state.may_touch_ground)
    hover_.lag(thrust_n);
  else
    hover_.step(thrust_n, state.specific_force_m_s2.z());
}

const CascadeOutput& Cascade::step(const ControlState& state, const CascadeCommand& command) {
  if (is_good(command))
    command_ = command;
  else
    ++bad_commands_;
  if (!is_good(state)) {
    ++bad_states_;
    return output_;
  }
  const float yaw_rad = euler_angles(state.attitude).yaw_rad;
  restart_changed_axes(state, yaw_rad);
  if (modes_.vertical == AxisMode::kDisabled) {
    stop_rotors();
    return output_;
  }
  const Wanted wanted = want(state, yaw_rad);
  limit(wanted, yaw_rad);
  float thrust_n = output_.rpyt.thrust_ratio * full_thrust_n_;
  if (params_.output == CascadeOutputKind::kRotors) thrust_n = drive_rotors(state, yaw_rad);
  learn(state, wanted, yaw_rad, thrust_n);
  output_.hover_thrust_ratio = hover_.hover_thrust_n() / full_thrust_n_;
  output_.lagged_thrust_ratio = hover_.lagged_thrust_n() / full_thrust_n_;
  return output_;
}

}  // namespace hm
