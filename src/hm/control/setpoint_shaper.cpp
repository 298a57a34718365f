#include "hm/control/setpoint_shaper.hpp"

namespace hm {
namespace {
/// Maximum yaw acceleration: about a fifth of what the rotors' drag torque gives in hover.
constexpr float kYawAcceleration_rad_s2 = 2;
/// Maximum change of the yaw acceleration in a second: reached in an eighth of a second.
constexpr float kYawJerk_rad_s3 = 16;
/// Shorter vectors have no direction worth turning the axes to.
constexpr float kLeastDirection = 0.01F;
/// A vehicle that cannot turn as fast as wanted is not asked to make up for more than this.
constexpr float kMaxYawLead_rad = 0.2F;
}  // namespace

AxisLimits SetpointShaper::horizontal_limits() const {
  const float speed = min_f(params_.speed_m_s, max_speed_m_s_);
  return {speed, speed, params_.acceleration_m_s2, params_.jerk_m_s3};
}

AxisLimits SetpointShaper::vertical_limits() const {
  return {min_f(params_.climb_m_s, max_climb_m_s_), min_f(params_.sink_m_s, max_sink_m_s_),
          params_.acceleration_m_s2, params_.jerk_m_s3};
}

AxisLimits SetpointShaper::heading_limits() const {
  return {params_.yaw_rate_rad_s, params_.yaw_rate_rad_s, kYawAcceleration_rad_s2, kYawJerk_rad_s3};
}

void SetpointShaper::limit_speed(float speed_m_s, float climb_m_s, float sink_m_s) {
  max_speed_m_s_ = max_f(0, speed_m_s);
  max_climb_m_s_ = max_f(0, climb_m_s);
  max_sink_m_s_ = max_f(0, sink_m_s);
}

void SetpointShaper::start_from(const MotionReference& state) {
  start_horizontal_from(state.position_m, state.velocity_m_s, state.acceleration_m_s2);
  start_vertical_from(state.position_m.z(), state.velocity_m_s.z(), state.acceleration_m_s2.z());
  start_heading_from(state.yaw_rad, state.yaw_rate_rad_s);
}

void SetpointShaper::start_horizontal_from(const Vec3f& position_m, const Vec3f& velocity_m_s,
                                           const Vec3f& acceleration_m_s2) {
  const float length = norm_f(acceleration_m_s2.x(), acceleration_m_s2.y());
  const float share = length > params_.acceleration_m_s2 ? params_.acceleration_m_s2 / length : 1;
  cos_ = 1;
  sin_ = 0;
  along_.start_from({0, velocity_m_s.x(), share * acceleration_m_s2.x()});
  across_.start_from({0, velocity_m_s.y(), share * acceleration_m_s2.y()});
  reference_.position_m.head<2>() = goal_m_.head<2>() = position_m.head<2>();
  reference_.velocity_m_s.head<2>() = velocity_m_s.head<2>();
  reference_.acceleration_m_s2.head<2>() = share * acceleration_m_s2.head<2>();
}

void SetpointShaper::start_vertical_from(float position_m, float velocity_m_s, float acceleration_m_s2) {
  const float acceleration =
      clamp_f(acceleration_m_s2, -params_.acceleration_m_s2, params_.acceleration_m_s2);
  vertical_.start_from({0, velocity_m_s, acceleration});
  reference_.position_m.z() = goal_m_.z() = position_m;
  reference_.velocity_m_s.z() = velocity_m_s;
  reference_.acceleration_m_s2.z() = acceleration;
}

void SetpointShaper::start_heading_from(float yaw_rad, float yaw_rate_rad_s) {
  heading_.start_from({0, yaw_rate_rad_s, 0});
  reference_.yaw_rad = goal_yaw_rad_ = wrap_angle_f(yaw_rad);
  reference_.yaw_rate_rad_s = yaw_rate_rad_s;
}

void SetpointShaper::align_to(float x, float y) {
  const float length = norm_f(x, y);
  if (length < kLeastDirection) return;
  const JerkLimitedAxis::State a = along_.state(), b = across_.state();
  const float old_cos = cos_, old_sin = sin_;
  cos_ = x / length;
  sin_ = y / length;
  const float c = old_cos * cos_ + old_sin * sin_, s = old_cos * sin_ - old_sin * cos_;
  along_.start_from(
      {c * a.to_go + s * b.to_go, c * a.velocity + s * b.velocity, c * a.acceleration + s * b.acceleration});
  across_.start_from(
      {c * b.to_go - s * a.to_go, c * b.velocity - s * a.velocity, c * b.acceleration - s * a.acceleration});
}

const MotionReference& SetpointShaper::step(const FlightModes& modes, const MotionGoal& goal,
                                            const Vec3f& measured_m, float measured_yaw_rad) {
  step_horizontal(modes.horizontal, goal, measured_m);
  step_vertical(modes.vertical, goal, measured_m.z());
  step_heading(modes.heading, goal, measured_yaw_rad);
  return reference_;
}

/// Moves the goal of both axes, and turns them so that the way from where the reference would come to rest
/// leads straight to it.
void SetpointShaper::follow_horizontal_goal(const Vec3f& goal_m, const AxisLimits& limits) {
  // Differences of goals, not of positions: far from the origin a position has fewer digits than a step is
  // long.
  const float x = goal_m.x() - goal_m_.x(), y = goal_m.y() - goal_m_.y();
  if (x == 0 && y == 0) return;
  goal_m_.head<2>() = goal_m.head<2>();
  along_.move_goal_by(cos_ * x + sin_ * y);
  across_.move_goal_by(cos_ * y - sin_ * x);
  const JerkLimitedAxis::State& a = along_.state();
  const JerkLimitedAxis::State& b = across_.state();
  const float along = a.to_go - stopping_distance(a.velocity, a.acceleration, limits);
  const float across = b.to_go - stopping_distance(b.velocity, b.acceleration, limits);
  align_to(world_x(along, across), world_y(along, across));
}

void SetpointShaper::step_horizontal(AxisMode mode, const MotionGoal& goal, const Vec3f& measured_m) {
  const AxisLimits limits = horizontal_limits();
  if (mode == AxisMode::kPosition) {
    follow_horizontal_goal(goal.position_m, limits);
    along_.step_to_goal(limits, step_s_);
    across_.step_to_goal(limits, step_s_);
    reference_.position_m.x() = goal_m_.x() - world_x(along_.state().to_go, across_.state().to_go);
    reference_.position_m.y() = goal_m_.y() - world_y(along_.state().to_go, across_.state().to_go);
  } else if (mode == AxisMode::kVelocity) {
    float vx = goal.velocity_m_s.x(), vy = goal.velocity_m_s.y();
    const float speed = norm_f(vx, vy);
    if (speed > limits.speed_up) {
      vx *= limits.speed_up / speed;
      vy *= limits.speed_up / speed;
    }
    align_to(vx - reference_.velocity_m_s.x(), vy - reference_.velocity_m_s.y());
    along_.step_to_velocity(cos_ * vx + sin_ * vy, limits, step_s_);
    across_.step_to_velocity(cos_ * vy - sin_ * vx, limits, step_s_);
    along_.stand_at_goal();
    across_.stand_at_goal();
    reference_.position_m.head<2>() = goal_m_.head<2>() = measured_m.head<2>();
  } else {
    return start_horizontal_from(measured_m, Vec3f::Zero(), Vec3f::Zero());
  }
  const JerkLimitedAxis::State& a = along_.state();
  const JerkLimitedAxis::State& b = across_.state();
  reference_.velocity_m_s.x() = world_x(a.velocity, b.velocity);
  reference_.velocity_m_s.y() = world_y(a.velocity, b.velocity);
  reference_.acceleration_m_s2.x() = world_x(a.acceleration, b.acceleration);
  reference_.acceleration_m_s2.y() = world_y(a.acceleration, b.acceleration);
}

void SetpointShaper::step_vertical(AxisMode mode, const MotionGoal& goal, float measured_m) {
  const AxisLimits limits = vertical_limits();
  if (mode == AxisMode::kPosition) {
    vertical_.move_goal_by(goal.position_m.z() - goal_m_.z());
    goal_m_.z() = goal.position_m.z();
    vertical_.step_to_goal(limits, step_s_);
    reference_.position_m.z() = goal_m_.z() - vertical_.state().to_go;
  } else if (mode == AxisMode::kVelocity) {
    vertical_.step_to_velocity(goal.velocity_m_s.z(), limits, step_s_);
    vertical_.stand_at_goal();
    reference_.position_m.z() = goal_m_.z() = measured_m;
  } else {
    return start_vertical_from(measured_m, 0, 0);
  }
  reference_.velocity_m_s.z() = vertical_.state().velocity;
  reference_.acceleration_m_s2.z() = vertical_.state().acceleration;
}

void SetpointShaper::step_heading(AxisMode mode, const MotionGoal& goal, float measured_rad) {
  const AxisLimits limits = heading_limits();
  if (mode == AxisMode::kPosition) {
    if (goal.yaw_rad != goal_yaw_rad_) {
      const JerkLimitedAxis::State& h = heading_.state();
      const float to_go = wrap_angle_f(h.to_go + wrap_angle_f(goal.yaw_rad - goal_yaw_rad_));
      heading_.start_from({to_go, h.velocity, h.acceleration});
      goal_yaw_rad_ = goal.yaw_rad;
    }
    heading_.step_to_goal(limits, step_s_);
    reference_.yaw_rad = wrap_angle_f(goal_yaw_rad_ - heading_.state().to_go);
  } else if (mode == AxisMode::kVelocity) {
    heading_.step_to_velocity(goal.yaw_rate_rad_s, limits, step_s_);
    // Moves with the reference, which stays within reach of the vehicle.
    const float ahead = wrap_angle_f(reference_.yaw_rad + step_s_ * heading_.state().velocity - measured_rad);
    reference_.yaw_rad = goal_yaw_rad_ =
        wrap_angle_f(measured_rad + clamp_f(ahead, -kMaxYawLead_rad, kMaxYawLead_rad));
    heading_.stand_at_goal();
  } else {
    return start_heading_from(measured_rad, 0);
  }
  reference_.yaw_rate_rad_s = heading_.state().velocity;
}

Vec3f SetpointShaper::stopping_point() const {
  const AxisLimits limits = horizontal_limits();
  const JerkLimitedAxis::State& a = along_.state();
  const JerkLimitedAxis::State& b = across_.state();
  const float along = stopping_distance(a.velocity, a.acceleration, limits);
  const float across = stopping_distance(b.velocity, b.acceleration, limits);
  const JerkLimitedAxis::State& z = vertical_.state();
  return reference_.position_m + Vec3f(world_x(along, across), world_y(along, across),
                                       stopping_distance(z.velocity, z.acceleration, vertical_limits()));
}

}  // namespace hm
