#pragma once
#include <span>

#include "hm/sim/world/world.hpp"

namespace hm {

/// A box on the floor, across the course (as long in y as kFlatObjectWidth_m).
struct FlatObject {
  double from_x_m = 0, to_x_m = 0;
  double height_m = 0;  ///< its upper side
};
inline constexpr double kFlatObjectWidth_m = 1.4;

/// The objects along the course, by x.
std::span<const FlatObject> height_course_objects();

/// Generates a hall of 11 x 4 x 3 m with flat objects of varying heights on its floor along y = 0, as the
/// place of the experiment of dissertation Fig. 2.5. A vehicle may stand at the origin, at the left end; x
/// runs along the hall. Pillars at the walls let a laser see how far it came.
World make_height_course();

/// Level of what lies below a point of the course, m: the floor (0) or an object's upper side.
[[nodiscard]] double height_course_level_m(double x_m, double y_m);

}  // namespace hm
