#include "hm/sim/world/house_plan.hpp"

namespace hm {

const std::vector<RoomPlan>& house_rooms() {
  static const std::vector<RoomPlan> rooms = {
      {"living", 0, 7.94, 0, 6.58, 6.4},        {"dining", 8.06, 12.44, 0, 6.58, 9.6},
      {"kitchen", 12.56, 15.94, 0, 6.58, 14.2}, {"study", 16.06, 20, 0, 6.58, 17.4},
      {"bedroom", 0, 4.94, 8.42, 15, 3.6},      {"bath", 5.06, 7.44, 8.42, 15, 6.3},
      {"kids", 7.56, 11.94, 8.42, 15, 9.4},     {"guest", 12.06, 16.44, 8.42, 15, 14.2},
      {"workshop", 16.56, 20, 8.42, 15, 18.1},
  };
  return rooms;
}

std::vector<Box3> house_doors() {
  std::vector<Box3> doors;
  for (const RoomPlan& room : house_rooms()) {
    const bool south = room.y1 < kHallCenter_y;
    const double low = south ? kHallLow_y - 2 * kHalfWall_m : kHallHigh_y;
    doors.emplace_back(Vec3(room.door_x - kDoorWidth_m / 2, low, 0),
                       Vec3(room.door_x + kDoorWidth_m / 2, low + 2 * kHalfWall_m, kDoorHeight_m));
  }
  return doors;
}

std::vector<Box3> house_arches() {
  return {Box3(Vec3(7.94, 2.7, 0), Vec3(8.06, 4.7, 2.3)), Box3(Vec3(12.44, 4.3, 0), Vec3(12.56, 5.6, 2.3))};
}

Box3 front_door() { return {Vec3(-0.2, 7.0, 0), Vec3(0, 8.0, kDoorHeight_m)}; }

std::vector<Box3> house_windows() {
  std::vector<Box3> windows;
  const auto south = [&](double x, double width, double sill) {
    windows.emplace_back(Vec3(x - width / 2, -kWholeOuterWall_m, sill), Vec3(x + width / 2, 0, 2.2));
  };
  const auto north = [&](double x, double width, double sill) {
    windows.emplace_back(Vec3(x - width / 2, kHouseWidth_m, sill),
                         Vec3(x + width / 2, kHouseWidth_m + kWholeOuterWall_m, 2.2));
  };
  south(2.2, 1.8, 1.0), south(6.4, 1.6, 0.9), south(10.2, 2.4, 0.3), south(14.0, 1.4, 1.2),
      south(17.6, 1.2, 2.0 - 0.9);
  north(3.7, 1.4, 0.9), north(6.2, 0.8, 1.5), north(10.2, 1.6, 0.9), north(15.6, 1.0, 0.9),
      north(18.1, 1.2, 1.2);
  windows.emplace_back(Vec3(-kWholeOuterWall_m, 1.4, 0.9), Vec3(0, 3.2, 2.2));       // living, west
  windows.emplace_back(Vec3(20, 4.2, 0.9), Vec3(20 + kWholeOuterWall_m, 5.6, 2.2));  // study, east
  windows.emplace_back(Vec3(20, 7.0, 0.4), Vec3(20 + kWholeOuterWall_m, 8.0, 2.2));  // end of the hallway
  windows.emplace_back(Vec3(-kWholeOuterWall_m, 13.2, 0.9), Vec3(0, 14.2, 2.2));     // bedroom, west
  return windows;
}

}  // namespace hm
