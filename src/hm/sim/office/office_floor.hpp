#pragma once
#include <cstdint>
#include <vector>

#include "hm/geometry/se3.hpp"

namespace hm {

/// A vertical surface, seen from above.
struct OfficeWall {
  Vec2 a, b;  ///< metres
  bool glass = false;
};

/// A room as a robot visits it.
struct OfficeRoom {
  Vec2 before_door, inside;  ///< in the middle of the corridor; a place to turn in
  bool open = false;         ///< a robot fits through the door
};

/// One floor of an office building at the height of a robot's laser. The lower left corner is at the origin.
struct OfficeFloor {
  std::vector<OfficeWall> walls;
  std::vector<OfficeRoom> rooms;
  std::vector<double> columns_m, rows_m;  ///< middle lines of the corridors, along y and along x
  static constexpr double kCorridor_m = 2.0;
};

/// Generates a floor: a grid of corridors with rows of rooms between them and along the outer walls. Most
/// rooms look the same; some are meeting rooms behind a pane of glass, some hold a thing of their own. Doors
/// are open, ajar or closed; the windows are of glass. The seed changes doors, furniture and glass, never the
/// corridors. Size of at least 30 x 30 m (checked).
OfficeFloor make_office_floor(double width_m, double depth_m, std::uint64_t seed);

}  // namespace hm
