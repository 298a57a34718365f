#pragma once
#include "hm/flight/testing/flight_rig.hpp"

namespace hm {

/// Flies what the core can do in about half a minute, from the ground to the ground: take-off, way points,
/// steps, velocity and direct commands, outages of pose, height, orientation and IMU with their fail-safes,
/// bad input, landing, and an emergency stop at the end.
void fly_course(FlightRig& rig);

}  // namespace hm
