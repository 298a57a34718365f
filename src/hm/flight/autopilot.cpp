#include "hm/flight/autopilot.hpp"

#include <cmath>

namespace hm {
namespace {

constexpr float kStep_s = 0.001F;
/// Charge that a metre of the way home takes: a full battery for 11 minutes at 1.5 m/s.
constexpr float kBatteryPerMetreRatio = 0.001F;
/// In kTakeOff the vehicle has left the ground when it is so far above home.
constexpr float kLiftedOff_m = 0.05F;
/// Time constant for the specific force of the ground: vibration is much faster.
constexpr float kCarriedFilter_s = 0.05F;
/// IMU samples whose stamp differs more from the step's time have a stamp of a clock that stepped.
constexpr Duration kMostImuAge{10'000'000};

/// Whether the vehicle goes back to kHold when this action is no longer needed.
bool ends_in_hold(SafetyAction action, FailSafe reason) {
  switch (action) {
    case SafetyAction::kReturn:
    case SafetyAction::kDeadReckoning:
    case SafetyAction::kSinkSlowly:
    case SafetyAction::kHoldMotors:
      return true;
    case SafetyAction::kLevelDescent:
      return is_recoverable(reason);
    default:
      return false;
  }
}

bool is_used(FusionStatus status) {
  return status == FusionStatus::kOk || status == FusionStatus::kStarted ||
         status == FusionStatus::kWaiting || status == FusionStatus::kRecovered;
}
bool is_invalid(FusionStatus status) {
  return status == FusionStatus::kInvalid || status == FusionStatus::kTimeBackwards ||
         status == FusionStatus::kTooOld || status == FusionStatus::kFromFuture;
}

}  // namespace

/// The estimator's history holds 190 ms.
AutopilotParams::AutopilotParams() { estimator.fusion.max_delay_s = 0.18F; }

Autopilot::Autopilot(const AutopilotParams& params)
    : law_(params.law),
      idle_speed_rad_s_(params.vehicle.idle_speed_rad_s),
      limits_(params.fail_safes),
      R_base_imu_(params.imu.R_base_imu),
      estimator_(params.estimator, params.imu),
      fail_safes_(params.fail_safes),
      gate_(params.commands),
      guidance_(params.guidance),
      published_(params.published, kStep_s),
      cascade_(params.cascade, params.vehicle, kStep_s) {}

const AutopilotOutputs& Autopilot::step(const AutopilotInputs& inputs) {
  if (started_ && inputs.now <= now_) {  // a step that was there already, or a clock that runs backwards
    ++outputs_.invalid_inputs;
    return outputs_;
  }
  if (!started_) pose_at_ = height_at_ = imu_at_ = set_point_at_ = computer_at_ = inputs.now;
  started_ = true;
  now_ = inputs.now;
  estimate(inputs);
  machine_.step(now_, inputs.motors_on);
  Refusal refusal = Refusal::kNone;
  if (inputs.command) {
    refusal = gate_.admit(*inputs.command, now_);
    if (refusal == Refusal::kNone) {
      refusal = obey(*inputs.command, inputs);
      if (refusal != Refusal::kNone) gate_.count(refusal);
    }
  }
  respond(fail_safes_.step(safety_inputs(inputs)));
  e_stop_ = false;
  follow_phase();
  if (action_ != SafetyAction::kHoldMotors) fly();
  publish(refusal);
  return outputs_;
}

void Autopilot::estimate(const AutopilotInputs& inputs) {
  if (inputs.imu) take_imu(*inputs.imu);
  if (inputs.pose) take_pose(*inputs.pose);
  if (inputs.height) take_height(*inputs.height);
  if (inputs.computer_alive) {
    computer_seen_ = true;
    computer_at_ = now_;
  }
  if (inputs.battery_ratio && std::isfinite(*inputs.battery_ratio)) {
    battery_known_ = true;
    battery_ratio_ = *inputs.battery_ratio;
  }
  clearance_m_ = inputs.clearance_m;
  state_ = estimator_.state();
  const auto& angles = state_.roll_pitch_yaw_rad;
  attitude_ = attitude_from({angles.x(), angles.y(), angles.z()});
}

/// In the air, a sample that repeats the last one to the bit is none: the sensor hangs.
void Autopilot::take_imu(InertialReading<float> imu) {
  const Duration age = now_ - imu.stamp;
  if (age > kMostImuAge || age < Duration{-kMostImuAge.ns}) {
    imu.stamp = now_;
    ++outputs_.invalid_inputs;
  }
  const Vec3f rates_rad_s = imu.angular_velocity_rad_s;
  const bool stands =
      machine_.state() == AutopilotState::kOff ||
      (!gyro_.is_calibrated() && !in_air(machine_.state()));  // motors vibrate: only if needed
  if (stands && is_finite_f(rates_rad_s)) gyro_.add(rates_rad_s);
  imu.angular_velocity_rad_s -= gyro_.bias_rad_s();
  const FusionStatus status = estimator_.add_imu(imu);
  if (is_invalid(status)) {
    ++outputs_.invalid_inputs;
    return;
  }
  const bool repeats = rates_rad_s == last_rates_rad_s_ && imu.specific_force_m_s2 == last_force_m_s2_;
  last_rates_rad_s_ = rates_rad_s;
  last_force_m_s2_ = imu.specific_force_m_s2;
  if (!repeats || !in_air(machine_.state())) imu_at_ = now_;
  specific_force_m_s2_ = R_base_imu_ * imu.specific_force_m_s2;
}

/// The estimator would take a repeated measurement for another one: it is counted as invalid.
bool Autopilot::is_newer(Time stamp, const std::optional<Time>& used) {
  const bool newer = !used || stamp > *used;
  if (!newer) ++outputs_.invalid_inputs;
  return newer;
}

void Autopilot::take_height(const BasicHeightReading<float>& height) {
  if (!is_newer(height.stamp, height_used_)) return;
  const FusionStatus status = estimator_.add_height(height);
  if (is_invalid(status)) ++outputs_.invalid_inputs;
  if (!is_used(status)) return;
  height_used_ = height.stamp;
  if (height.stamp > height_at_) height_at_ = height.stamp;
}

void Autopilot::take_pose(const PoseReading<float>& pose) {
  if (!is_newer(pose.stamp, pose_used_)) return;
  const PoseReading<float> turned_back = turn_back(pose);
  const FusionStatus status = is_doubtful(pose) ? FusionStatus::kRejected : estimator_.add_pose(turned_back);
  if (is_invalid(status)) ++outputs_.invalid_inputs;
  if (is_used(status)) {
    pose_used_ = pose.stamp;
    if (pose.stamp > pose_at_) pose_at_ = pose.stamp;
    refused_since_.reset();
  }
  if (status == FusionStatus::kRejected && !refused_since_) refused_since_ = now_;
  if (is_used(status) || status == FusionStatus::kRejected)
    tilt_.add_pose(pose.stamp, pose.x_y_yaw.x(), pose.x_y_yaw.y());
}

/// Poses of a sensor that is turned on the vehicle move it along wrong directions: each step between them is
/// turned back by the angle that is known, from where the vehicle was taken to be when this was noticed.
PoseReading<float> Autopilot::turn_back(const PoseReading<float>& pose) {
  if (!turned_rad_ || !last_pose_) return pose;
  const Vec3f raw = pose.x_y_yaw - last_pose_->x_y_yaw;
  const SinCos turn = sin_cos_f(*turned_rad_);
  turned_back_m_.x() += turn.cos * raw.x() + turn.sin * raw.y();
  turned_back_m_.y() += turn.cos * raw.y() - turn.sin * raw.x();
  PoseReading<float> result = pose;
  result.x_y_yaw.x() = turned_back_m_.x();
  result.x_y_yaw.y() = turned_back_m_.y();
  return result;
}

/// The frame of the poses is continuous: a jump beyond what the velocity explains shows that their sensor or
/// its perception fails. Such poses are refused until the vehicle is on the ground, or soon comes back to
/// where inertia sees it.
bool Autopilot::is_doubtful(const PoseReading<float>& pose) {
  if (!in_air(machine_.state())) {
    jumped_at_.reset();
    turned_rad_.reset();
  } else if (!jumped_at_ && jumps(pose)) {
    jumped_at_ = now_;
  } else if (jumped_at_ && now_ - *jumped_at_ < duration_of(limits_.pose_lost_s)) {
    const float age_s = seconds_of<float>(now_ - pose.stamp);
    const Vec3f& v = state_.velocity_m_s;
    const float away_m = norm_f(pose.x_y_yaw.x() - state_.position_m.x() + age_s * v.x(),
                                pose.x_y_yaw.y() - state_.position_m.y() + age_s * v.y());
    if (away_m < limits_.pose_jump_m) jumped_at_.reset();
  }
  last_pose_ = pose;
  return jumped_at_.has_value();
}

bool Autopilot::jumps(const PoseReading<float>& pose) const {
  if (!last_pose_) return false;
  const Duration step = pose.stamp - last_pose_->stamp;
  if (step <= Duration{} || step > duration_of(limits_.pose_stale_s)) return false;
  const float dt_s = seconds_of<float>(step);
  const Vec3f& v = state_.velocity_m_s;
  const float moved_m = norm_f(pose.x_y_yaw.x() - last_pose_->x_y_yaw.x() - dt_s * v.x(),
                               pose.x_y_yaw.y() - last_pose_->x_y_yaw.y() - dt_s * v.y());
  return moved_m > limits_.pose_jump_m;
}

ControlState Autopilot::control_state() const {
  ControlState state;
  state.position_m = state_.position_m;
  state.velocity_m_s = state_.velocity_m_s;
  state.attitude = attitude_;
  state.rates_rad_s = state_.angular_velocity_rad_s;
  state.specific_force_m_s2 = specific_force_m_s2_;
  const bool climbs = machine_.phase() == FlightPhase::kTakeOff;
  const bool lifted = state_.position_m.z() > guidance_.goal_m().z() - takeoff_height_m_ + kLiftedOff_m;
  state.airborne =
      in_air(machine_.state()) && machine_.phase() != FlightPhase::kTouchDown && (!climbs || lifted);
  state.may_touch_ground = machine_.phase() == FlightPhase::kDescend || action_ == SafetyAction::kSinkSlowly;
  return state;
}

Refusal Autopilot::may_take_off(const AutopilotInputs& inputs) const {
  const SafetyInputs safety = safety_inputs(inputs);
  const bool fresh = safety.pose_age < duration_of(limits_.pose_stale_s) &&
                     safety.height_age < duration_of(limits_.height_stale_s) &&
                     safety.imu_age < duration_of(limits_.imu_gap_s);
  if (!state_.planar_ready || !state_.height_ready || !fresh || !gyro_.is_calibrated())
    return Refusal::kNotReady;
  const float least = max_f(safety.return_need_ratio, limits_.battery_empty_ratio);
  if (battery_known_ && battery_ratio_ < least) return Refusal::kBatteryLow;
  return Refusal::kNone;
}

Refusal Autopilot::obey(const FlightCommand& command, const AutopilotInputs& inputs) {
  if (command.kind == CommandKind::kEStop) {
    e_stop_ = true;
    return Refusal::kNone;
  }
  const ActionConditions conditions{inputs.rc_enabled, may_take_off(inputs)};
  switch (command.kind) {
    case CommandKind::kTakeOver:
    case CommandKind::kRelease:
    case CommandKind::kSignOfLife:
      return Refusal::kNone;
    case CommandKind::kToggleEngage:
      return machine_.act(FlightAction::kToggleEngage, conditions);
    case CommandKind::kReset:
      return machine_.act(FlightAction::kReset, conditions);
    case CommandKind::kLand:
      return machine_.act(FlightAction::kLand, conditions);
    case CommandKind::kTakeOff: {
      const Refusal refusal = machine_.act(FlightAction::kTakeOff, conditions);
      if (refusal != Refusal::kNone) return refusal;
      cascade_.reset();  // all integrals start from zero
      guidance_.take_off(control_state(), state_.roll_pitch_yaw_rad.z(), command.position_m.z());
      takeoff_height_m_ = guidance_.goal_m().z() - state_.position_m.z();
      return refusal;
    }
    default:
      break;
  }
  if (!inputs.rc_enabled) return Refusal::kRcDisabled;
  if (machine_.state() == AutopilotState::kError) return Refusal::kErrorLatched;
  return obey_in_flight(command);
}

Refusal Autopilot::change_mode(FlightPhase mode) {
  const Refusal refusal = machine_.enter_phase(mode);
  if (refusal == Refusal::kNone) set_point_at_ = now_;
  follow_phase();
  return refusal;
}

Refusal Autopilot::obey_in_flight(const FlightCommand& command) {
  if (!in_air(machine_.state())) return Refusal::kNotFlying;
  if (machine_.landing_forced()) return Refusal::kLandingForced;
  if (machine_.state() == AutopilotState::kLanding && command.kind != CommandKind::kHold)
    return Refusal::kWrongMode;
  if (action_ >= SafetyAction::kReturn) return Refusal::kFailSafeActive;
  const FlightPhase phase = machine_.phase();
  switch (command.kind) {
    case CommandKind::kHold:
      return change_mode(FlightPhase::kHold);
    case CommandKind::kMode: {
      const bool for_pilots = command.mode >= FlightPhase::kPosition &&
                              command.mode <= FlightPhase::kReturn &&
                              command.mode != FlightPhase::kDeadReckoning;
      return for_pilots ? change_mode(command.mode) : Refusal::kWrongMode;
    }
    case CommandKind::kVelocity:
    case CommandKind::kDirect:
    case CommandKind::kPath: {
      const FlightPhase needed = command.kind == CommandKind::kVelocity ? FlightPhase::kVelocity
                                 : command.kind == CommandKind::kDirect ? FlightPhase::kDirect
                                                                        : FlightPhase::kPath;
      if (phase != needed) return Refusal::kWrongMode;
      if (command.kind != CommandKind::kPath && !command.dead_man) return change_mode(FlightPhase::kHold);
      guidance_.set_velocity(command);
      set_point_at_ = command.stamp;
      return Refusal::kNone;
    }
    case CommandKind::kGoTo:
    case CommandKind::kPositionStep: {
      if (phase != FlightPhase::kPosition && phase != FlightPhase::kHold) return Refusal::kWrongMode;
      const Refusal mode = change_mode(FlightPhase::kPosition);
      if (mode != Refusal::kNone) return mode;
      if (command.kind == CommandKind::kGoTo) return guidance_.go_to(command.position_m, command.yaw_rad);
      return guidance_.step_by(command.position_m, command.yaw_rad, state_.roll_pitch_yaw_rad.z());
    }
    default:
      return Refusal::kNotSupported;
  }
}

SafetyInputs Autopilot::safety_inputs(const AutopilotInputs& inputs) const {
  SafetyInputs safety;
  safety.now = now_;
  safety.airborne = in_air(machine_.state());
  safety.e_stop = e_stop_;
  safety.pose_age = now_ - pose_at_;
  safety.height_age = now_ - height_at_;
  safety.imu_age = now_ - imu_at_;
  if (refused_since_) safety.poses_refused = now_ - *refused_since_;
  const float variance = max_f(state_.planar_covariance(0, 0), state_.planar_covariance(1, 1));
  safety.position_std_m = std::sqrt(variance);
  const FlightPhase phase = machine_.phase();
  if (phase == FlightPhase::kVelocity || phase == FlightPhase::kPath)
    safety.velocity_age = now_ - set_point_at_;
  if (phase == FlightPhase::kDirect) safety.direct_age = now_ - set_point_at_;
  if (const std::optional<Time> heard = gate_.last_heard()) safety.pilot_age = now_ - *heard;
  if (computer_seen_) safety.computer_age = now_ - computer_at_;
  if (battery_known_) safety.battery_ratio = battery_ratio_;
  safety.return_need_ratio =
      limits_.battery_empty_ratio + kBatteryPerMetreRatio * guidance_.way_home_m(state_.position_m);
  const bool shaped = phase != FlightPhase::kTakeOff;  // whose goal is inside
  if (shaped) safety.stop_outside_m = guidance_.outside_m(cascade_.stopping_point());
  safety.outside_m = guidance_.outside_m(state_.position_m);
  if (inputs.obstacle_m) safety.obstacle_m = inputs.obstacle_m;
  safety.stopping_distance_m = norm_f(Vec3f(cascade_.stopping_point() - state_.position_m));
  safety.thrust_saturated = cascade_.output().thrust_limited;
  safety.climb_m_s = state_.velocity_m_s.z();
  safety.tilt_rad = attitude_.tilt_rad();
  safety.cos_tilt_error = cos_tilt_error();
  safety.tilt_mismatch_rad = turned_rad_ ? turned_rad_ : tilt_.mismatch_rad();
  if (safety.tilt_mismatch_rad) safety.tilt_mismatch_rad = std::abs(*safety.tilt_mismatch_rad);
  return safety;
}

/// Cosine between the rotors' direction and the commanded one; 1 while no thrust is commanded, which has no
/// direction.
float Autopilot::cos_tilt_error() const {
  constexpr float kLeastForce_m_s2 = 1;
  const Vec3f& wanted = cascade_.output().specific_force_m_s2;
  const float force = norm_f(wanted);
  return force < kLeastForce_m_s2 ? 1 : dot_f(attitude_.up_axis(), wanted) / force;
}

/// Carries the worst action out; what has ended leads to kHold.
void Autopilot::respond(const SafetyVerdict& verdict) {
  const SafetyAction action = verdict.action;
  if (action < action_ && ends_in_hold(action_, action_reason_)) machine_.recover_to_hold();
  action_ = action;
  action_reason_ = verdict.reason;
  const bool flying = machine_.state() == AutopilotState::kFlying;
  switch (action) {
    case SafetyAction::kCut:
      machine_.fail();
      break;
    case SafetyAction::kLand:
    case SafetyAction::kLevelDescent:
      machine_.force_landing();
      break;
    case SafetyAction::kDeadReckoning:
      if (flying) machine_.enter_phase(FlightPhase::kDeadReckoning);
      break;
    case SafetyAction::kReturn:
      if (flying) machine_.enter_phase(FlightPhase::kReturn);
      break;
    case SafetyAction::kHold:
    case SafetyAction::kBrake:
      if (flying && machine_.phase() != FlightPhase::kTakeOff) machine_.enter_phase(FlightPhase::kHold);
      break;
    default:
      break;
  }
}

/// Lets the guidance begin a new phase.
void Autopilot::follow_phase() {
  if (machine_.phase() == phase_) return;
  phase_ = machine_.phase();
  touchdown_.reset();
  guidance_.enter(phase_, control_state(), cascade_.output().reference, cascade_.stopping_point());
  if (phase_ == FlightPhase::kTouchDown) guidance_.note_thrust(cascade_.output().rpyt.thrust_ratio);
}

void Autopilot::fly() {
  const ControlState state = control_state();
  check_tilt(state);
  if (machine_.motor_demand() != MotorDemand::kControl) {
    cascade_.step(state, {});  // rotors stopped
    published_.reset();
    return;
  }
  const SafetyVerdict& verdict = fail_safes_.verdict();
  GuidanceSigns signs;
  signs.pose_lost = verdict.has(FailSafe::kPoseStale) || verdict.has(FailSafe::kPoseRefused) ||
                    verdict.has(FailSafe::kPoseLost);
  signs.height_lost = verdict.has(FailSafe::kHeightStale);
  signs.fence_ahead = verdict.has(FailSafe::kFenceAhead);
  signs.hover_thrust_ratio = cascade_.output().hover_thrust_ratio;
  signs.thrust_share = machine_.thrust_share();
  const auto& speeds = state_.planar_velocity_covariance;
  signs.speed_std_m_s = std::sqrt(max_f(max_f(speeds(0, 0), speeds(1, 1)), 0));
  signs.climb_std_m_s = std::sqrt(max_f(state_.climb_variance, 0));
  CascadeCommand command = guidance_.step(machine_.phase(), state, state_.roll_pitch_yaw_rad.z(), signs);
  if (law_ == ControlLaw::kPublished) command = flown_by(published_, state, command);
  cascade_.step(state, command);
  if (guidance_.arrived() && machine_.phase() == FlightPhase::kTakeOff) machine_.took_off();
  if (guidance_.arrived() && machine_.phase() == FlightPhase::kReturn)
    (void)machine_.act(FlightAction::kLand, {});
  find_ground();
}

void Autopilot::check_tilt(const ControlState& state) {
  if (!state.airborne) {
    tilt_.reset();
    mismatch_since_.reset();
    return;
  }
  const Vec3f force = state.attitude.rotate(state.specific_force_m_s2);
  tilt_.step(force.x(), force.y(), kStep_s);
  const std::optional<float> mismatch = tilt_.mismatch_rad();
  if (turned_rad_ && mismatch) turned_rad_ = mismatch;  // better known than before
  if (!mismatch || std::abs(*mismatch) < limits_.tilt_mismatch_rad) {
    mismatch_since_.reset();
    return;
  }
  if (!mismatch_since_) mismatch_since_ = now_;
  if (turned_rad_ || now_ - *mismatch_since_ < duration_of(limits_.tilt_doubt_s)) return;
  turned_rad_ = mismatch;
  turned_back_m_ = state_.position_m;
}

void Autopilot::find_ground() {
  const CascadeOutput& output = cascade_.output();
  const float hover = max_f(output.hover_thrust_ratio, 0.05F);
  const float by_rotors_m_s2 = kGravityF_m_s2 * output.lagged_thrust_ratio / hover;
  carried_m_s2_ += kStep_s / kCarriedFilter_s * (specific_force_m_s2_.z() - by_rotors_m_s2 - carried_m_s2_);
  const bool flying = machine_.state() == AutopilotState::kFlying;
  if (machine_.phase() != FlightPhase::kDescend && !(flying && action_ == SafetyAction::kSinkSlowly)) return;
  GroundSigns signs;
  signs.carried_m_s2 = carried_m_s2_;
  signs.wanted_climb_m_s = guidance_.wanted_climb_m_s();
  signs.climb_m_s = state_.velocity_m_s.z();
  signs.thrust_per_hover = output.rpyt.thrust_ratio / hover;
  signs.clearance_m = clearance_m_;
  if (!touchdown_.step(now_, signs)) return;
  if (flying) machine_.force_landing();  // it sank without a height, until it stood
  machine_.touched_down();
}

void Autopilot::publish(Refusal refusal) {
  AutopilotOutputs& out = outputs_;
  out.stamp = now_;
  out.refusal = refusal;
  out.state = machine_.state();
  out.phase = machine_.phase();
  out.safety = fail_safes_.verdict();
  out.tilt_mismatch_rad = turned_rad_ ? turned_rad_ : tilt_.mismatch_rad();
  out.motors = machine_.motor_demand();
  out.reference = cascade_.output().reference;
  if (action_ == SafetyAction::kHoldMotors && out.motors == MotorDemand::kControl) return;  // as they are
  const bool controlled = out.motors == MotorDemand::kControl;
  const bool idle = out.motors == MotorDemand::kIdle;
  out.rpyt = controlled ? cascade_.output().rpyt : RpytCommand{};
  out.rotor_speed_rad_s.fill(idle ? idle_speed_rad_s_ : 0);
  if (controlled) out.rotor_speed_rad_s = cascade_.output().rotor_speed_rad_s;
}

}  // namespace hm
