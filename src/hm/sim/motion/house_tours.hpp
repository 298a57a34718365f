#pragma once
#include <cstddef>
#include <span>

namespace hm {

/// A place where the walk through the house passes, and where the camera looks there (angles as in
/// WalkPoint). In between it moves and turns evenly, the short way round.
struct TourStop {
  double x_m, y_m;
  double yaw_rad, pitch_rad;
  int room = -1;  ///< visited from here; an index into house_rooms()
};

/// The way through a room, from just behind its door and back there, clear of the furniture.
std::span<const TourStop> room_tour(std::size_t room);
/// The way through the hallway, from the front door to the east end and back. A room is visited from the
/// middle of the hallway before its door: the southern ones on the way out, the northern ones on the way
/// back.
std::span<const TourStop> hall_tour();

}  // namespace hm
