#pragma once
#include <string>
#include <vector>

#include "hm/geometry/se3.hpp"

namespace hm {

enum class RoomShape { kShell, kBox, kSphere, kWedge };
std::string_view to_string(RoomShape shape);

/// Analytic solid of the room. Shell: the free space is the box `center` +- `half_m`, its walls are
/// `kRoomWall_m` thick around it. Box: rotated by `yaw_rad` about z. Sphere: radius half_m.x(). Wedge: a
/// right triangle in x and z (right angle at -x, -z; slope falls towards +x), extruded along y.
struct RoomPrimitive {
  std::string name;
  RoomShape shape = RoomShape::kBox;
  Vec3 center = Vec3::Zero();
  Vec3 half_m = Vec3::Zero();
  double yaw_rad = 0;
};

inline constexpr double kRoomWall_m = 0.15;

/// Solids of make_room(), the shell first.
const std::vector<RoomPrimitive>& room_primitives();

/// Signed distance to one solid, metres, positive outside the solid (exact, except beyond the outer edges
/// within a shell's wall).
double primitive_sdf(const RoomPrimitive& primitive, const Vec3& p_world);

/// Signed distance to the surface of make_room(), metres: positive in free space, negative inside solids.
/// Union by minimum: exact in free space, a lower bound of the depth inside touching solids.
double room_sdf(const Vec3& p_world);

}  // namespace hm
