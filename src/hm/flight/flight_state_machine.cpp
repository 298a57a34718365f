#include "hm/flight/flight_state_machine.hpp"

#include "hm/estimation/filter_math.hpp"

namespace hm {
namespace {

/// Motors that take longer to start or stop are an error.
constexpr float kMotorTransition_s = 2.0F;
/// Duration after which a change of the motors is accepted: a single wrong report lasts 1 ms.
constexpr float kMotorDebounce_s = 0.005F;
/// Duration in which the thrust is taken away after touch-down, so that the vehicle does not tip over.
constexpr float kThrustRamp_s = 0.5F;
/// Time without thrust after which the vehicle counts as landed.
constexpr float kLanded_s = 0.3F;

}  // namespace

FlightStateMachine::FlightStateMachine()
    : transition_(duration_of(kMotorTransition_s)),
      debounce_(duration_of(kMotorDebounce_s)),
      ramp_(duration_of(kThrustRamp_s)),
      landed_(duration_of(kLanded_s)) {}

void FlightStateMachine::go(AutopilotState state, FlightPhase phase) {
  state_ = state;
  phase_ = phase;
  entered_ = now_;
  if (state != AutopilotState::kLanding) landing_forced_ = false;
}

Refusal FlightStateMachine::act(FlightAction action, const ActionConditions& conditions) {
  if (action == FlightAction::kEStop) {
    fail();
    return Refusal::kNone;
  }
  if (!conditions.rc_enabled) return Refusal::kRcDisabled;
  if (action == FlightAction::kReset) {
    if (state_ != AutopilotState::kError) return Refusal::kNoError;
    if (motors_on_) return Refusal::kMotorsOn;
    go(AutopilotState::kOff, FlightPhase::kGround);
    return Refusal::kNone;
  }
  if (state_ == AutopilotState::kError) return Refusal::kErrorLatched;
  switch (action) {
    case FlightAction::kToggleEngage:
      return toggle_engage();
    case FlightAction::kTakeOff:
      return take_off(conditions.take_off);
    case FlightAction::kLand:
      return land();
    default:
      return Refusal::kNotSupported;
  }
}

Refusal FlightStateMachine::toggle_engage() {
  switch (state_) {
    case AutopilotState::kOff:
      go(AutopilotState::kEngaging, FlightPhase::kGround);
      return Refusal::kNone;
    case AutopilotState::kIdle:
      go(AutopilotState::kDisengaging, FlightPhase::kGround);
      return Refusal::kNone;
    case AutopilotState::kEngaging:
    case AutopilotState::kDisengaging:
      return Refusal::kInTransition;
    default:
      return Refusal::kAlreadyFlying;
  }
}

Refusal FlightStateMachine::take_off(Refusal refusal) {
  switch (state_) {
    case AutopilotState::kOff:
      return Refusal::kMotorsOff;
    case AutopilotState::kEngaging:
    case AutopilotState::kDisengaging:
      return Refusal::kInTransition;
    case AutopilotState::kIdle:
      break;
    default:
      return Refusal::kAlreadyFlying;
  }
  if (refusal == Refusal::kNone) go(AutopilotState::kFlying, FlightPhase::kTakeOff);
  return refusal;
}

Refusal FlightStateMachine::land() {
  if (state_ == AutopilotState::kLanding) return Refusal::kNone;  // it does already
  if (state_ != AutopilotState::kFlying) return Refusal::kNotFlying;
  go(AutopilotState::kLanding, FlightPhase::kDescend);
  return Refusal::kNone;
}

Refusal FlightStateMachine::enter_phase(FlightPhase phase) {
  if (phase == phase_ && in_air(state_)) return Refusal::kNone;
  if (state_ == AutopilotState::kLanding) {
    if (phase_ == FlightPhase::kTouchDown) return Refusal::kTouchedDown;
    if (landing_forced_) return Refusal::kLandingForced;
    if (phase != FlightPhase::kHold) return Refusal::kWrongMode;
  } else if (state_ != AutopilotState::kFlying) {
    return Refusal::kNotFlying;
  }
  const bool within_flying = phase >= FlightPhase::kPosition && phase <= FlightPhase::kReturn;
  if (!within_flying) return Refusal::kWrongMode;
  go(AutopilotState::kFlying, phase);
  return Refusal::kNone;
}

void FlightStateMachine::force_landing() {
  if (state_ == AutopilotState::kFlying) go(AutopilotState::kLanding, FlightPhase::kDescend);
  if (state_ == AutopilotState::kLanding) landing_forced_ = true;
}

void FlightStateMachine::recover_to_hold() {
  const bool descends = phase_ == FlightPhase::kDescend && landing_forced_;
  if (descends || state_ == AutopilotState::kFlying) go(AutopilotState::kFlying, FlightPhase::kHold);
}

void FlightStateMachine::fail() {
  if (state_ != AutopilotState::kError) go(AutopilotState::kError, FlightPhase::kGround);
}

void FlightStateMachine::touched_down() {
  if (phase_ != FlightPhase::kDescend) return;
  const bool forced = landing_forced_;
  go(AutopilotState::kLanding, FlightPhase::kTouchDown);
  landing_forced_ = forced;
}

void FlightStateMachine::took_off() {
  if (phase_ == FlightPhase::kTakeOff) go(AutopilotState::kFlying, FlightPhase::kPosition);
}

void FlightStateMachine::step(Time now, bool motors_on) {
  if (!started_) {
    started_ = true;
    entered_ = motors_as_before_ = now;
  }
  now_ = now;
  debounce(motors_on);
  const bool between = state_ == AutopilotState::kEngaging || state_ == AutopilotState::kDisengaging;
  if (between && in_state() >= transition_) fail();
  if (phase_ == FlightPhase::kTouchDown && in_state() >= ramp_ + landed_)
    go(AutopilotState::kIdle, FlightPhase::kGround);
}

/// A change counts once it has lasted.
void FlightStateMachine::debounce(bool motors_on) {
  if (motors_on == motors_on_) {
    motors_as_before_ = now_;
  } else if (now_ - motors_as_before_ >= debounce_) {
    motors_on_ = motors_on;
    motors_as_before_ = now_;
    motors_changed();
  }
}

void FlightStateMachine::motors_changed() {
  if (state_ == AutopilotState::kError) return;
  if (!motors_on_)
    go(AutopilotState::kOff, FlightPhase::kGround);
  else if (state_ == AutopilotState::kOff || state_ == AutopilotState::kEngaging)
    go(AutopilotState::kIdle, FlightPhase::kGround);
}

MotorDemand FlightStateMachine::motor_demand() const {
  switch (state_) {
    case AutopilotState::kEngaging:
      return MotorDemand::kStart;
    case AutopilotState::kDisengaging:
      return MotorDemand::kStop;
    case AutopilotState::kIdle:
      return MotorDemand::kIdle;
    case AutopilotState::kFlying:
      return MotorDemand::kControl;
    case AutopilotState::kLanding:
      return thrust_share() > 0 ? MotorDemand::kControl : MotorDemand::kIdle;
    default:
      return MotorDemand::kOff;
  }
}

float FlightStateMachine::thrust_share() const {
  if (phase_ != FlightPhase::kTouchDown) return 1;
  if (in_state() >= ramp_) return 0;
  return 1.0F - seconds_of<float>(in_state()) / seconds_of<float>(ramp_);
}

}  // namespace hm
