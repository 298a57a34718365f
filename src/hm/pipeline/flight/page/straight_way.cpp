#include "hm/pipeline/flight/page/straight_way.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

/// State of a place within the height that the laser sees: occupied if anything is, else free if anything is.
Occupancy state_around(const MultiVolumeGrid& grid, const Vec3& place_m, double height_m) {
  const double step_m = grid.params().resolution_m / 2;
  Occupancy state = Occupancy::kUnknown;
  for (double z = -height_m; z <= height_m; z += step_m) {
    const Occupancy here = grid.at(place_m + Vec3(0, 0, z));
    if (here == Occupancy::kOccupied) return here;
    if (here == Occupancy::kFree) state = here;
  }
  return state;
}

}  // namespace

StraightWay straight_way(const MultiVolumeGrid& grid, const Vec3& from_m, const Vec3& to_m,
                         const StraightWayParams& params) {
  StraightWay way;
  way.points_m = {from_m};
  const double length_m = (to_m - from_m).norm();
  const auto refused = [&](double at_m, const std::string& why) {
    way.points_m.push_back(from_m + (to_m - from_m) * (length_m > 0 ? at_m / length_m : 0));
    way.refusal = why;
    return way;
  };
  if (!to_m.allFinite() || !from_m.allFinite()) return refused(0, "the goal is no place");
  if (length_m > params.longest_m)
    return refused(
        0, fmt::format("the goal is {:.0f} m away, farther than {:.0f} m", length_m, params.longest_m));
  const Vec2 along = (to_m - from_m).head<2>();
  const Vec2 ahead = along.norm() > 1e-6 ? Vec2(along.normalized()) : Vec2::UnitX();
  const Vec3 across(-ahead.y(), ahead.x(), 0);
  const double step_m = grid.params().resolution_m;
  const auto sides = static_cast<int>(std::ceil(params.hull_radius_m / step_m));
  const auto steps = static_cast<int>(std::ceil((length_m + params.hull_radius_m) / step_m));
  for (int i = 0; i <= steps; ++i) {
    const double at_m = i * step_m;
    const Vec3 middle = from_m + (to_m - from_m) * std::min(1.0, length_m > 0 ? at_m / length_m : 1) +
                        Vec3(ahead.x(), ahead.y(), 0) * std::max(0.0, at_m - length_m);
    for (int side = -sides; side <= sides; ++side) {
      const Vec3 place =
          middle + across * std::clamp(side * step_m, -params.hull_radius_m, params.hull_radius_m);
      if ((place - from_m).norm() < params.free_start_m) continue;
      const Occupancy state = state_around(grid, place, params.seen_height_m);
      if (state == Occupancy::kOccupied)
        return refused(std::min(at_m, length_m),
                       fmt::format("something stands in the way after {:.1f} m", at_m));
      if (state == Occupancy::kUnknown)
        return refused(std::min(at_m, length_m),
                       fmt::format("nothing is known of the way after {:.1f} m", at_m));
    }
  }
  way.points_m.push_back(to_m);
  return way;
}

}  // namespace hm
