#include "hm/flight/guidance.hpp"

namespace hm {
namespace {
/// Sinking speed without a pose, down to kFlareHeight_m: the vehicle drifts meanwhile, so it is faster than a
/// landing.
constexpr float kBlindDescend_m_s = 0.7F;
/// Height above home below which it sinks as in a landing.
constexpr float kFlareHeight_m = 0.6F;
/// Maximum tilt without a pose, 10 degrees: it bounds the speed that nothing measures.
constexpr float kDeadReckoningTilt_rad = 0.175F;
/// Thrust without a height, per hover thrust: a little less than what carries the vehicle.
constexpr float kSinkThrustRatio = 0.97F;
/// Reduction of that thrust per climbing speed: 0.3 m/s of sinking balance it.
constexpr float kSinkDamping_s_m = 0.1F;
/// Reduction of that thrust in a second once the ground should have been reached.
constexpr float kSinkFade_per_s = 0.3F;
/// Without pose or height, the velocity of inertia is controlled up to this standard deviation.
constexpr float kInertialStd_m_s = 1.5F;

constexpr float kGuidanceStep_s = 0.001F;
constexpr FlightModes kToPosition{AxisMode::kPosition, AxisMode::kPosition, AxisMode::kPosition};

/// A vector of the level frame of the vehicle in the odom frame.
Vec3f turned_by_yaw(const Vec3f& level, float yaw_rad) {
  const SinCos turn = sin_cos_f(yaw_rad);
  return {turn.cos * level.x() - turn.sin * level.y(), turn.sin * level.x() + turn.cos * level.y(),
          level.z()};
}

}  // namespace

void Guidance::take_off(const ControlState& state, float yaw_rad, float height_m) {
  home_m_ = state.position_m;
  path_.start(home_m_);
  goal_m_ = home_m_;
  goal_m_.z() += clamp_f(height_m > 0 ? height_m : params_.takeoff_height_m, 0, params_.fence_height_m);
  goal_yaw_rad_ = yaw_rad;
  arrived_ = false;
}

void Guidance::enter(FlightPhase phase, const ControlState& state, const MotionReference& reference,
                     const Vec3f& rest) {
  arrived_ = false;
  set_point_ = {};
  const bool took_off = phase_ == FlightPhase::kTakeOff && phase == FlightPhase::kPosition;  // the goal stays
  phase_ = phase;
  if (took_off || phase == FlightPhase::kTakeOff || phase == FlightPhase::kTouchDown) return;
  goal_m_ = rest;
  goal_yaw_rad_ = reference.yaw_rad;
  if (phase == FlightPhase::kDeadReckoning) goal_m_.z() = state.position_m.z();
}

float Guidance::outside_m(const Vec3f& position_m) const {
  const Vec3f from_home = position_m - home_m_;
  const float sideways = norm_f(from_home.x(), from_home.y()) - params_.fence_radius_m;
  return max_f(0, max_f(sideways, from_home.z() - params_.fence_height_m));
}

Refusal Guidance::go_to(const Vec3f& position_m, float yaw_rad) {
  if (outside_m(position_m) > 0) return Refusal::kOutOfRange;
  goal_m_ = position_m;
  goal_yaw_rad_ = wrap_angle_f(yaw_rad);
  return Refusal::kNone;
}

Refusal Guidance::step_by(const Vec3f& step_level_m, float step_yaw_rad, float yaw_rad) {
  return go_to(goal_m_ + turned_by_yaw(step_level_m, yaw_rad), goal_yaw_rad_ + step_yaw_rad);
}

CascadeCommand Guidance::step(FlightPhase phase, const ControlState& state, float yaw_rad,
                              const GuidanceSigns& signs) {
  CascadeCommand command;
  const bool lost = signs.pose_lost || signs.height_lost;
  if (!lost && phase != FlightPhase::kReturn) path_.record(state.position_m);
  switch (phase) {
    case FlightPhase::kTakeOff:
      follow_goal(command);
      command.limits.climb_m_s = params_.takeoff_climb_m_s;
      arrived_ = state.position_m.z() > goal_m_.z() - params_.arrival_m;
      break;
    case FlightPhase::kVelocity:
      fly_velocity(command, yaw_rad, signs.fence_ahead);
      break;
    case FlightPhase::kDirect:
      fly_directly(command);
      break;
    case FlightPhase::kPath:
      fly_path(command);
      break;
    case FlightPhase::kReturn:
      fly_home(command, state);
      break;
    case FlightPhase::kDeadReckoning:
      follow_goal(command);
      command.modes.horizontal = AxisMode::kVelocity;
      command.limits.tilt_rad = kDeadReckoningTilt_rad;
      break;
    case FlightPhase::kDescend:
      descend(command, state, signs);
      break;
    case FlightPhase::kTouchDown:
      touch_down(command, signs);
      break;
    default:
      follow_goal(command);
      break;
  }
  if (!signs.height_lost) {
    sink_left_m_ = max_f(state.position_m.z() - home_m_.z(), 0) + kFlareHeight_m;
    sink_share_ = 1;
  } else if (phase != FlightPhase::kTouchDown) {
    descend_blindly(command, phase, state, signs);
  }
  const bool by_speed = command.modes.vertical == AxisMode::kVelocity;
  wanted_climb_m_s_ = by_speed                                              ? command.goal.velocity_m_s.z()
                      : signs.height_lost || phase == FlightPhase::kDescend ? -params_.descend_m_s
                                                                            : 0;
  return command;
}

void Guidance::follow_goal(CascadeCommand& command) const {
  command.modes = kToPosition;
  command.goal.position_m = goal_m_;
  command.goal.yaw_rad = goal_yaw_rad_;
}

void Guidance::fly_home(CascadeCommand& command, const ControlState& state) {
  const bool near = norm_f(Vec3f(state.position_m - goal_m_)) < params_.arrival_m;
  const bool last = path_.size() <= 1;
  if (last) {  // above home, at the height of the way there
    const Vec3f& home = path_.last();
    const float height_m = max_f(goal_m_.z(), home.z() + params_.arrival_m);
    goal_m_ = Vec3f(home.x(), home.y(), height_m);
    arrived_ =
        near && norm_f(state.position_m.x() - home.x(), state.position_m.y() - home.y()) < params_.arrival_m;
  } else if (near || norm_f(Vec3f(goal_m_ - path_.last())) > params_.arrival_m) {
    // The first goal is the last point; a point that is reached gives way to the one before.
    if (near && norm_f(Vec3f(goal_m_ - path_.last())) <= params_.arrival_m) path_.drop_last();
    if (path_.size() > 1) goal_m_ = path_.last();
  }
  follow_goal(command);
}

void Guidance::fly_velocity(CascadeCommand& command, float yaw_rad, bool fence_ahead) const {
  command.modes = {AxisMode::kVelocity, AxisMode::kVelocity, AxisMode::kVelocity};
  if (!fence_ahead) command.goal.velocity_m_s = turned_by_yaw(set_point_.velocity_m_s, yaw_rad);
  command.goal.yaw_rate_rad_s = set_point_.yaw_rad;
}

void Guidance::fly_path(CascadeCommand& command) const {
  if (set_point_.pilot == 0) return follow_goal(command);  // until the first moment of the motion comes
  command.modes = kToPosition;
  command.shaped = false;
  command.goal.position_m = set_point_.position_m;
  command.goal.velocity_m_s = set_point_.velocity_m_s;
  command.goal.yaw_rad = set_point_.yaw_rad;
  command.goal.yaw_rate_rad_s = set_point_.yaw_rate_rad_s;
  command.acceleration_m_s2 = set_point_.acceleration_m_s2;
}

void Guidance::fly_directly(CascadeCommand& command) const {
  if (set_point_.pilot == 0) return follow_goal(command);  // until the first command comes
  command.modes = {AxisMode::kDirect, AxisMode::kDirect, AxisMode::kDirect};
  command.direct = {set_point_.roll_rad, set_point_.pitch_rad, set_point_.yaw_rate_rad_s,
                    set_point_.thrust_ratio};
}

/// Without a pose it brakes by the velocity that inertia gives, as long as that is worth something, then
/// stays level; and it hurries, because what is left of velocity and tilt carries it off.
void Guidance::descend(CascadeCommand& command, const ControlState& state, const GuidanceSigns& signs) const {
  follow_goal(command);
  command.modes.vertical = AxisMode::kVelocity;
  command.goal.velocity_m_s = Vec3f(0, 0, -params_.descend_m_s);
  if (!signs.pose_lost) return;
  const bool inertial = signs.speed_std_m_s < kInertialStd_m_s;
  command.modes.horizontal = inertial ? AxisMode::kVelocity : AxisMode::kDisabled;
  command.limits.tilt_rad = kDeadReckoningTilt_rad;
  const bool high = state.position_m.z() - home_m_.z() > kFlareHeight_m;
  if (high) command.goal.velocity_m_s.z() = -max_f(kBlindDescend_m_s, params_.descend_m_s);
}

/// Level, with a thrust that falls from that of the touch-down to none.
void Guidance::touch_down(CascadeCommand& command, const GuidanceSigns& signs) const {
  const float thrust = signs.thrust_share * touchdown_thrust_;
  command.modes = {AxisMode::kDisabled, AxisMode::kDirect, AxisMode::kDisabled};
  command.direct.thrust_ratio = thrust;
  command.limits.thrust_ratio = thrust;
}

/// Without a height: a landing goes by the climb rate that inertia gives, as long as that is worth something
/// and until the ground should have been reached; whatever else is flown sinks slowly.
void Guidance::descend_blindly(CascadeCommand& command, FlightPhase phase, const ControlState& state,
                               const GuidanceSigns& signs) {
  const bool lands = phase == FlightPhase::kDescend;
  const bool inertial = lands && sink_left_m_ > 0 && signs.climb_std_m_s < kInertialStd_m_s;
  const float sinking_m_s =
      inertial ? -command.goal.velocity_m_s.z() : (1 - kSinkThrustRatio) / kSinkDamping_s_m;
  sink_left_m_ -= kGuidanceStep_s * sinking_m_s;
  if (!inertial) sink_slowly(command, state, signs);
}

/// A little less thrust than hovering takes, against what the accelerometer notes of climbing and sinking.
/// Once the ground should have been reached the thrust falls: on the ground nothing happens but that the
/// touch-down is found, in the air the vehicle sinks a little faster.
void Guidance::sink_slowly(CascadeCommand& command, const ControlState& state, const GuidanceSigns& signs) {
  constexpr float kMostChange = 0.15F;  // per hover thrust: the climb rate drifts without a height
  if (sink_left_m_ < 0) sink_share_ = max_f(sink_share_ - kGuidanceStep_s * kSinkFade_per_s, 0.5F);
  const float change = kSinkThrustRatio - 1 - kSinkDamping_s_m * state.velocity_m_s.z();
  command.modes.vertical = AxisMode::kDirect;
  command.direct.thrust_ratio =
      sink_share_ * signs.hover_thrust_ratio * (1 + clamp_f(change, -kMostChange, kMostChange));
}

}  // namespace hm
