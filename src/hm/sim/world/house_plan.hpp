#pragma once
#include <array>
#include <string>
#include <vector>

#include "hm/geometry/box.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Room of the house: its inner rectangle and the centre of its door to the hallway, metres.
struct RoomPlan {
  std::string name;
  double x0 = 0, x1 = 0, y0 = 0, y1 = 0;
  double door_x = 0;
};

// The house: inner faces of the outer walls at x = 0, 20 and y = 0, 15; hallway from west to east.
inline constexpr double kHouseLength_m = 20, kHouseWidth_m = 15, kHouseHeight_m = 2.7;
inline constexpr double kHallLow_y = 6.7, kHallHigh_y = 8.3, kHallCenter_y = 7.5;
inline constexpr double kHalfWall_m = 0.06;   ///< each room builds its half of an inner wall
inline constexpr double kOuterWall_m = 0.14;  ///< behind the half wall of the outer rooms
inline constexpr double kWholeOuterWall_m = kHalfWall_m + kOuterWall_m;
inline constexpr double kDoorWidth_m = 1.0, kDoorHeight_m = 2.1;

/// The nine rooms: four in the south from west to east, then five in the north.
const std::vector<RoomPlan>& house_rooms();
/// Openings in the walls: doors to the hallway (one per room, in the order of house_rooms()), arches between
/// rooms, the front door, windows.
std::vector<Box3> house_doors();
std::vector<Box3> house_arches();
Box3 front_door();
std::vector<Box3> house_windows();

}  // namespace hm
