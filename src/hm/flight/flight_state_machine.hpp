#pragma once
#include <cstdint>

#include "hm/core/time.hpp"
#include "hm/flight/flight_state.hpp"

namespace hm {

/// Conditions of actions besides the state.
struct ActionConditions {
  bool rc_enabled = true;             ///< switch of the remote control: commands of computers count
  Refusal take_off = Refusal::kNone;  ///< why the vehicle may not take off now
};

/// The state machine of dissertation 2.3.1, Fig. 2.6, with timed transitions.
///
/// kError latches, unlike in the author's firmware, where starting the motors by remote control left it: only
/// kReset with stopped motors leads to kOff. The emergency stop works in every state and without the remote
/// control's switch; all other actions need it. An action that is not carried out changes nothing and returns
/// why.
class FlightStateMachine {
 public:
  FlightStateMachine();

  /// Carries out an action at once.
  Refusal act(FlightAction action, const ActionConditions& conditions);
  /// One step: observes the motors and lets time pass. The first step only sets the clock.
  void step(Time now, bool motors_on);
  /// Changes the phase within kFlying: pilots and fail-safes. In kLanding only kHold, while it descends and
  /// the landing is not forced.
  Refusal enter_phase(FlightPhase phase);
  /// Fail-safes: lands (in flight only); a forced landing cannot be ended by a pilot.
  void force_landing();
  /// Fail-safes: ends a landing that was forced, if it still descends.
  void recover_to_hold();
  /// Fail-safes: cuts the motors and latches.
  void fail();
  /// The touch-down detector found the ground: from kDescend only.
  void touched_down();
  /// The take-off height is reached: from kTakeOff only.
  void took_off();

  [[nodiscard]] AutopilotState state() const { return state_; }
  [[nodiscard]] FlightPhase phase() const { return phase_; }
  [[nodiscard]] bool landing_forced() const { return landing_forced_; }
  [[nodiscard]] MotorDemand motor_demand() const;
  /// Share of the thrust that remains in kTouchDown: 1 to 0; 1 elsewhere.
  [[nodiscard]] float thrust_share() const;
  [[nodiscard]] bool motors_on() const { return motors_on_; }  ///< debounced
  [[nodiscard]] Duration in_state() const { return now_ - entered_; }

 private:
  Refusal toggle_engage();
  Refusal take_off(Refusal refusal);
  Refusal land();
  void go(AutopilotState state, FlightPhase phase);
  void debounce(bool motors_on);
  void motors_changed();

  Duration transition_, debounce_, ramp_, landed_;
  AutopilotState state_ = AutopilotState::kOff;
  FlightPhase phase_ = FlightPhase::kGround;
  bool started_ = false, motors_on_ = false, landing_forced_ = false;
  Time now_, entered_, motors_as_before_;  // entered_: state or phase
};

}  // namespace hm
