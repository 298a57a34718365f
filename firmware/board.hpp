#pragma once
#include <cstdint>

#include "hm/flight/autopilot.hpp"

/// What a board must give to the firmware, in SI units and the frames of docs/frames_and_units.md. A folder
/// with the files of a board defines these functions, the start-up code and a linker script.
namespace hm::board {

/// Prepares clocks and devices; called once, after the constructors of global objects.
void start();

/// Waits for the next step (a millisecond after the one before) and gives what has arrived since then, valid
/// until the next call:
/// - `now`: time of the vehicle's clock, later than in the step before;
/// - `imu`: rates and specific force in the frame of the IMU, with the time of the sample; nothing if there
///   is no new one. R_world_imu only if the device estimates its orientation itself;
/// - `pose`, `height`, `command`: the newest packet of each from the on-board computer or the pilot, with
///   stamps on the vehicle's clock;
/// - `motors_on`: whether the motor controllers report that the motors turn; `rc_enabled`: switch of the
///   remote control; `computer_alive`: whether a packet has come from the on-board computer;
/// - `battery_ratio`, `clearance_m`, `obstacle_m`, if the board measures them.
const AutopilotInputs& wait_step();

/// Drives the motors: `outputs.motors` and, for kControl and kIdle, the speeds of the four rotors (rad/s,
/// order as in hm/control/mixer.hpp); and sends telemetry.
void drive(const AutopilotOutputs& outputs, const BasicVehicleState<float>& estimate);

/// Called when the processor faults: stops the motors for good.
[[noreturn]] void stop_motors();

}  // namespace hm::board
