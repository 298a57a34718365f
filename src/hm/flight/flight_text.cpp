#include "hm/flight/flight_text.hpp"

namespace hm {

std::string_view text_of(AutopilotState state) {
  switch (state) {
    case AutopilotState::kOff:
      return "off";
    case AutopilotState::kEngaging:
      return "engaging";
    case AutopilotState::kDisengaging:
      return "disengaging";
    case AutopilotState::kIdle:
      return "idle";
    case AutopilotState::kLanding:
      return "landing";
    case AutopilotState::kFlying:
      return "flying";
    case AutopilotState::kError:
      return "error";
  }
  return "unknown";
}

std::string_view text_of(FlightPhase phase) {
  switch (phase) {
    case FlightPhase::kGround:
      return "on the ground";
    case FlightPhase::kTakeOff:
      return "take-off";
    case FlightPhase::kPosition:
      return "position";
    case FlightPhase::kVelocity:
      return "velocity";
    case FlightPhase::kDirect:
      return "direct";
    case FlightPhase::kPath:
      return "path";
    case FlightPhase::kHold:
      return "hold";
    case FlightPhase::kDeadReckoning:
      return "dead reckoning";
    case FlightPhase::kReturn:
      return "return";
    case FlightPhase::kDescend:
      return "descend";
    case FlightPhase::kTouchDown:
      return "touch-down";
  }
  return "unknown";
}

std::string_view text_of(Refusal refusal) {
  switch (refusal) {
    case Refusal::kNone:
      return "accepted";
    case Refusal::kRcDisabled:
      return "the remote control's switch does not enable the autopilot";
    case Refusal::kErrorLatched:
      return "an error is latched: reset with the motors off";
    case Refusal::kMotorsOn:
      return "the motors still turn: reset needs them off";
    case Refusal::kNoError:
      return "there is no error to reset";
    case Refusal::kInTransition:
      return "the motors are being started or stopped: wait";
    case Refusal::kMotorsOff:
      return "the motors are off: engage first";
    case Refusal::kNotFlying:
      return "the vehicle does not fly";
    case Refusal::kAlreadyFlying:
      return "the vehicle flies: land first";
    case Refusal::kLandingForced:
      return "a fail-safe lands the vehicle";
    case Refusal::kTouchedDown:
      return "the vehicle is on the ground already";
    case Refusal::kNotSupported:
      return "the action has no meaning";
    case Refusal::kNotReady:
      return "position, height or attitude is not known yet, or the vehicle has not stood still for a second";
    case Refusal::kBatteryLow:
      return "the battery is too low for a flight";
    case Refusal::kFailSafeActive:
      return "a fail-safe controls the vehicle";
    case Refusal::kOtherPilot:
      return "another pilot has control: take over first";
    case Refusal::kNoPilot:
      return "the command names no pilot (1 to 255)";
    case Refusal::kWrongMode:
      return "not in this mode: change it first";
    case Refusal::kNotANumber:
      return "a value is not finite";
    case Refusal::kOutOfRange:
      return "a value is beyond its limit, or the goal outside of the fence";
    case Refusal::kStaleStamp:
      return "the command is too old";
    case Refusal::kFutureStamp:
      return "the command's stamp lies in the future: clocks differ";
    case Refusal::kBackwardStamp:
      return "the command is not newer than the previous one";
  }
  return "unknown";
}

std::string_view text_of(FailSafe reason) {
  switch (reason) {
    case FailSafe::kPoseStale:
      return "no pose";
    case FailSafe::kPoseLost:
      return "position lost";
    case FailSafe::kHeightStale:
      return "no height";
    case FailSafe::kPoseRefused:
      return "poses contradict the estimate";
    case FailSafe::kSetpointStale:
      return "set-points stopped";
    case FailSafe::kPilotLost:
      return "no sign of the pilot";
    case FailSafe::kPilotGone:
      return "no sign of the pilot for long";
    case FailSafe::kComputerSilent:
      return "on-board computer silent";
    case FailSafe::kBatteryForReturn:
      return "battery just enough to return";
    case FailSafe::kBatteryEmpty:
      return "battery empty";
    case FailSafe::kFenceAhead:
      return "fence ahead";
    case FailSafe::kFenceLeft:
      return "outside of the fence";
    case FailSafe::kFenceFarOutside:
      return "far outside of the fence";
    case FailSafe::kObstacleAhead:
      return "obstacle ahead";
    case FailSafe::kNoLift:
      return "sinking at full thrust";
    case FailSafe::kImuGap:
      return "gap in the IMU's data";
    case FailSafe::kImuLost:
      return "IMU lost";
    case FailSafe::kOverturned:
      return "overturned";
    case FailSafe::kUncontrolled:
      return "the attitude does not follow its command";
    case FailSafe::kTiltMismatch:
      return "tilt and motion disagree: the position sensor is turned";
    case FailSafe::kEStop:
      return "emergency stop";
  }
  return "unknown";
}

}  // namespace hm
