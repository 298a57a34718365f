#pragma once
#include <cstdint>
#include <vector>

#include "hm/geometry/se2.hpp"
#include "hm/sim/office/office_floor.hpp"

namespace hm {

/// A robot's pose at a moment, and whether it scans there.
struct DrivePose {
  double time_s = 0;  ///< since the start
  SE2 T_world_base;   ///< x forward
  bool scans = false;
};

/// A drive along all corridors of a floor, the first ones more than once, into some of the rooms whose door
/// is open and out again. The robot turns on the spot and drives straight (0.28 m/s, 0.34 rad/s), and scans
/// after every metre or 0.5 rad, all as the robot of the log whose wheels WheelErrors describe, or after
/// every `scan_every_m` (over 0) and half as many radians. Poses lie at most 0.1 m or 0.05 rad apart.
std::vector<DrivePose> make_office_drive(const OfficeFloor& floor, std::uint64_t seed,
                                         double scan_every_m = 1);

}  // namespace hm
