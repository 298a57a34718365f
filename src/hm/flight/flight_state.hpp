#pragma once
#include <cstdint>

namespace hm {

/// The published states of the vehicle (dissertation 2.3.1, Fig. 2.6), with the codes of its serial protocol.
enum class AutopilotState : std::uint8_t {
  kOff = 0x00,          ///< motors without power
  kEngaging = 0x01,     ///< motors are being started
  kDisengaging = 0x02,  ///< motors are being stopped
  kIdle = 0x03,         ///< motors turn at their least speed
  kLanding = 0x04,
  kFlying = 0x05,
  kError = 0xFF,  ///< motors cut; latched until reset with the motors off
};

/// Phase within kFlying and kLanding; kGround in all other states.
enum class FlightPhase : std::uint8_t {
  kGround,
  kTakeOff,        ///< Flying: climbs to the take-off height
  kPosition,       ///< Flying: goes to and keeps a position
  kVelocity,       ///< Flying: keeps a velocity that a pilot gives again and again
  kDirect,         ///< Flying: attitude and thrust of a pilot or another controller pass through
  kPath,           ///< Flying: follows references that a planner gives
  kHold,           ///< Flying: comes to rest and stays; where all recovery leads
  kDeadReckoning,  ///< Flying: without a pose, keeps still as well as inertia tells
  kReturn,         ///< Flying: goes home along its own path, then lands
  kDescend,        ///< Landing: sinks at the place, or level where the place is not known
  kTouchDown,      ///< Landing: on the ground, thrust is taken away
};

/// Actions (dissertation 2.3.1) with the codes of the serial protocol; kReset is ours.
enum class FlightAction : std::uint8_t {
  kEStop = 0,
  kAdvance = 1,  ///< declared by the protocol, without a meaning: refused
  kRetreat = 2,  ///< as kAdvance
  kToggleEngage = 3,
  kTakeOff = 4,
  kLand = 5,
  kReset = 6,  ///< leaves kError
};

/// Why a command was not carried out.
enum class Refusal : std::uint8_t {
  kNone,            ///< it was
  kRcDisabled,      ///< the remote control's switch does not enable the autopilot
  kErrorLatched,    ///< only a reset leads out of kError
  kMotorsOn,        ///< a reset needs stopped motors
  kNoError,         ///< there is nothing to reset
  kInTransition,    ///< motors are being started or stopped
  kMotorsOff,       ///< engage first
  kNotFlying,       ///< only in flight
  kAlreadyFlying,   ///< only on the ground
  kLandingForced,   ///< a fail-safe lands the vehicle
  kTouchedDown,     ///< too late: it is on the ground
  kNotSupported,    ///< the action has no meaning
  kNotReady,        ///< no position, height or attitude yet, or gyroscopes not calibrated
  kBatteryLow,      ///< not enough for a flight
  kFailSafeActive,  ///< a fail-safe controls the vehicle
  kOtherPilot,      ///< another pilot has control: take over first
  kNoPilot,         ///< pilots have identities other than 0
  kWrongMode,       ///< not in this mode: change it first
  kNotANumber,      ///< a value is not finite
  kOutOfRange,      ///< beyond the limits or the fence
  kStaleStamp,      ///< sent too long ago
  kFutureStamp,     ///< sent later than now
  kBackwardStamp,   ///< not sent later than this pilot's previous command
};
inline constexpr int kRefusalCount = static_cast<int>(Refusal::kBackwardStamp) + 1;

/// Demand on the motors.
enum class MotorDemand : std::uint8_t {
  kOff,      ///< no power
  kStart,    ///< run the start sequence (published: full yaw stick, no thrust)
  kStop,     ///< run the stop sequence
  kIdle,     ///< least speed
  kControl,  ///< as the controllers ask
};

[[nodiscard]] constexpr bool in_air(AutopilotState state) {
  return state == AutopilotState::kFlying || state == AutopilotState::kLanding;
}

}  // namespace hm
