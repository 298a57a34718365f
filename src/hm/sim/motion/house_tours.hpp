#pragma once
#include <cstddef>
#include <span>

namespace hm {

/// Way point of the walk through the house, with the camera's direction (angles as in WalkPoint). In between,
/// position and angles are interpolated linearly, the angles along the shorter way.
struct TourStop {
  double x_m, y_m;
  double yaw_rad, pitch_rad;
  int room = -1;  ///< visited from here; an index into house_rooms()
};

/// Path through a room, from just behind its door and back, clear of the furniture.
std::span<const TourStop> room_tour(std::size_t room);
/// Path through the hallway, from the front door to the east end and back. Rooms are visited from the middle
/// of the hallway before their doors: the southern ones on the way out, the northern ones on the way back.
std::span<const TourStop> hall_tour();

}  // namespace hm
