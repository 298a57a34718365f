#pragma once
#include <span>

#include "hm/geometry/triangle_mesh.hpp"

namespace hm {

// Closed solids, oriented outwards, appended to a mesh. Metres, world frame.

/// Appends an axis-aligned box between two corners.
void append_box(TriangleMesh& mesh, const Vec3& low, const Vec3& high);
/// Appends a box of half sizes `half` around `center`, rotated by `yaw_rad` about z.
void append_turned_box(TriangleMesh& mesh, const Vec3& center, const Vec3& half, double yaw_rad);

/// Cylinder or truncated cone from a to b, approximated by `sides` faces.
struct Rod {
  Vec3 a = Vec3::Zero(), b = Vec3::UnitZ();
  double radius_a = 0.01, radius_b = 0.01;
  int sides = 8;
};
void append_rod(TriangleMesh& mesh, const Rod& rod);

/// Appends an axis-aligned ellipsoid of `rings` (>= 2) rings with twice as many vertices each.
void append_ellipsoid(TriangleMesh& mesh, const Vec3& center, const Vec3& radii, int rings);

/// Appends a prism: a convex polygon (counter-clockwise seen from the side that `extrusion` points to)
/// extruded along `extrusion`.
void append_prism(TriangleMesh& mesh, std::span<const Vec3> polygon, const Vec3& extrusion);

}  // namespace hm
