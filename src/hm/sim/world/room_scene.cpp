#include "hm/sim/world/room_scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "hm/sim/world/solids.hpp"
#include "hm/sim/world/world.hpp"

namespace hm {
namespace {

constexpr int kSphereRings = 200;  ///< within 0.07 mm of a sphere of 0.5 m

double box_sdf(const Vec3& p, const Vec3& half) {
  const Vec3 q = p.cwiseAbs() - half;
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
}

/// Signed distance in the plane to the right triangle (-a, -b), (a, -b), (-a, b).
double triangle_sdf(const Vec2& p, double a, double b) {
  const std::array<Vec2, 3> corner = {Vec2(-a, -b), Vec2(a, -b), Vec2(-a, b)};
  double nearest = std::numeric_limits<double>::infinity();
  bool inside = true;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec2 edge = corner[(i + 1) % 3] - corner[i], to = p - corner[i];
    const double along = std::clamp(to.dot(edge) / edge.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, (to - along * edge).norm());
    inside = inside && edge.x() * to.y() - edge.y() * to.x() > 0;
  }
  return inside ? -nearest : nearest;
}

double wedge_sdf(const Vec3& p, const Vec3& half) {
  const double flat = triangle_sdf({p.x(), p.z()}, half.x(), half.z());
  const double along = std::abs(p.y()) - half.y();
  return std::min(std::max(flat, along), 0.0) + std::hypot(std::max(flat, 0.0), std::max(along, 0.0));
}

void append_shell(TriangleMesh& mesh, const RoomPrimitive& shell) {
  // The outer skin, and the inner one turned inside out: together the boundary of the walls.
  append_turned_box(mesh, shell.center, shell.half_m + Vec3::Constant(kRoomWall_m), 0);
  const std::size_t outer = mesh.triangles.size();
  append_turned_box(mesh, shell.center, shell.half_m, 0);
  for (std::size_t i = outer; i < mesh.triangles.size(); ++i)
    std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
}

void append_primitive(TriangleMesh& mesh, const RoomPrimitive& primitive) {
  const Vec3 &c = primitive.center, &h = primitive.half_m;
  switch (primitive.shape) {
    case RoomShape::kShell:
      append_shell(mesh, primitive);
      break;
    case RoomShape::kBox:
      append_turned_box(mesh, c, h, primitive.yaw_rad);
      break;
    case RoomShape::kSphere:
      append_ellipsoid(mesh, c, Vec3::Constant(h.x()), kSphereRings);
      break;
    case RoomShape::kWedge: {
      const std::array<Vec3, 3> triangle = {c + Vec3(-h.x(), h.y(), -h.z()), c + Vec3(h.x(), h.y(), -h.z()),
                                            c + Vec3(-h.x(), h.y(), h.z())};
      append_prism(mesh, triangle, Vec3(0, -2 * h.y(), 0));
      break;
    }
  }
}

}  // namespace

std::string_view to_string(RoomShape shape) {
  constexpr std::string_view kNames[] = {"shell", "box", "sphere", "wedge"};
  return kNames[static_cast<std::size_t>(shape)];
}

const std::vector<RoomPrimitive>& room_primitives() {
  static const std::vector<RoomPrimitive> primitives = {
      {"walls", RoomShape::kShell, {0, 0, 1.4}, {3, 2, 1.4}, 0},
      {"cupboard", RoomShape::kBox, {-2.4, -1.6, 0.9}, {0.6, 0.4, 0.9}, 0},
      {"chest", RoomShape::kBox, {1.9, 1.15, 0.3}, {0.5, 0.35, 0.3}, 0.5},
      {"shelf", RoomShape::kBox, {2.8, -0.6, 1.5}, {0.2, 0.7, 0.03}, 0},
      {"column", RoomShape::kBox, {-2.0, 1.4, 1.4}, {0.1, 0.1, 1.4}, 0.35},
      {"ball", RoomShape::kSphere, {0.5, -1.3, 0.45}, {0.45, 0.45, 0.45}, 0},
      {"lamp", RoomShape::kSphere, {0.3, 0.4, 2.35}, {0.25, 0.25, 0.25}, 0},
      {"ramp", RoomShape::kWedge, {-0.6, 1.5, 0.35}, {0.7, 0.5, 0.35}, 0},
  };
  return primitives;
}

double primitive_sdf(const RoomPrimitive& primitive, const Vec3& p_world) {
  const Vec3 p = p_world - primitive.center;
  switch (primitive.shape) {
    case RoomShape::kShell:
      return std::max(-box_sdf(p, primitive.half_m),
                      box_sdf(p, primitive.half_m + Vec3::Constant(kRoomWall_m)));
    case RoomShape::kBox: {
      const double c = std::cos(primitive.yaw_rad), s = std::sin(primitive.yaw_rad);
      return box_sdf({c * p.x() + s * p.y(), c * p.y() - s * p.x(), p.z()}, primitive.half_m);
    }
    case RoomShape::kSphere:
      return p.norm() - primitive.half_m.x();
    case RoomShape::kWedge:
      return wedge_sdf(p, primitive.half_m);
  }
  return 0;
}

double room_sdf(const Vec3& p_world) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const RoomPrimitive& primitive : room_primitives())
    nearest = std::min(nearest, primitive_sdf(primitive, p_world));
  return nearest;
}

World make_room() {
  constexpr Pattern kPatterns[] = {Pattern::kWallpaper, Pattern::kWoodgrain, Pattern::kPlanks,
                                   Pattern::kTiles,     Pattern::kStone,     Pattern::kPainting,
                                   Pattern::kPlain,     Pattern::kFabric};
  constexpr Rgb8 kBase[] = {{226, 214, 190}, {170, 116, 70}, {196, 150, 98},  {210, 210, 220},
                            {180, 170, 165}, {200, 80, 60},  {250, 240, 200}, {90, 120, 170}};
  World world{"room", {}};
  for (std::size_t i = 0; i < room_primitives().size(); ++i) {
    const RoomPrimitive& primitive = room_primitives()[i];
    Material material{primitive.name, kPatterns[i % 8],    kBase[i % 8], {110, 90, 80},
                      0.15f,          Reflectance::kNormal};
    world.parts.push_back({std::move(material), {}});
    append_primitive(world.parts.back().mesh, primitive);
  }
  return world;
}

}  // namespace hm
