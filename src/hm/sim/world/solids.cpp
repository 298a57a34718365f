#include "hm/sim/world/solids.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace hm {
namespace {

std::uint32_t add(TriangleMesh& mesh, const Vec3& p) {
  mesh.vertices.push_back(p.cast<float>());
  return static_cast<std::uint32_t>(mesh.vertices.size() - 1);
}

void add_quad(TriangleMesh& mesh, std::array<std::uint32_t, 4> q) {
  mesh.triangles.push_back({q[0], q[1], q[2]});
  mesh.triangles.push_back({q[0], q[2], q[3]});
}

}  // namespace

void append_box(TriangleMesh& mesh, const Vec3& low, const Vec3& high) {
  append_turned_box(mesh, 0.5 * (low + high), 0.5 * (high - low), 0.0);
}

void append_turned_box(TriangleMesh& mesh, const Vec3& center, const Vec3& half, double yaw_rad) {
  HM_CHECK(half.minCoeff() > 0, "half sizes {} {} {}", half.x(), half.y(), half.z());
  const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
  std::array<Vec3, 4> polygon;
  constexpr int kX[] = {-1, 1, 1, -1}, kY[] = {-1, -1, 1, 1};
  for (std::size_t i = 0; i < 4; ++i) {
    const double x = kX[i] * half.x(), y = kY[i] * half.y();
    polygon[i] = center + Vec3(c * x - s * y, s * x + c * y, -half.z());
  }
  append_prism(mesh, polygon, Vec3(0, 0, 2 * half.z()));
}

void append_rod(TriangleMesh& mesh, const Rod& rod) {
  const Vec3 axis = (rod.b - rod.a).normalized();
  const Vec3 side = axis.unitOrthogonal(), other = axis.cross(side);
  const auto sides = static_cast<std::uint32_t>(rod.sides);
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (std::uint32_t i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * i / sides;
    const Vec3 out = std::cos(angle) * side + std::sin(angle) * other;
    add(mesh, rod.a + rod.radius_a * out);
    add(mesh, rod.b + rod.radius_b * out);
  }
  const std::uint32_t cap_a = add(mesh, rod.a), cap_b = add(mesh, rod.b);
  for (std::uint32_t i = 0; i < sides; ++i) {
    const std::uint32_t j = (i + 1) % sides;
    add_quad(mesh, {first + 2 * i, first + 2 * j, first + 2 * j + 1, first + 2 * i + 1});
    mesh.triangles.push_back({cap_a, first + 2 * j, first + 2 * i});
    mesh.triangles.push_back({cap_b, first + 2 * i + 1, first + 2 * j + 1});
  }
}

void append_ellipsoid(TriangleMesh& mesh, const Vec3& center, const Vec3& radii, int rings) {
  HM_CHECK(rings >= 2, "rings = {}", rings);
  const auto n = static_cast<std::uint32_t>(2 * rings), inner = static_cast<std::uint32_t>(rings - 1);
  const std::uint32_t south = add(mesh, center - Vec3(0, 0, radii.z()));
  const std::uint32_t north = add(mesh, center + Vec3(0, 0, radii.z()));
  const std::uint32_t first = north + 1;
  for (std::uint32_t ring = 0; ring < inner; ++ring) {
    const double latitude = std::numbers::pi * ((ring + 1.0) / rings - 0.5);
    for (std::uint32_t i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * i / n;
      const Vec3 unit(std::cos(latitude) * std::cos(angle), std::cos(latitude) * std::sin(angle),
                      std::sin(latitude));
      add(mesh, center + radii.cwiseProduct(unit));
    }
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n, top = first + (inner - 1) * n;
    mesh.triangles.push_back({south, first + j, first + i});
    mesh.triangles.push_back({north, top + i, top + j});
    for (std::uint32_t ring = 0; ring + 1 < inner; ++ring) {
      const std::uint32_t low = first + ring * n, high = low + n;
      add_quad(mesh, {low + i, low + j, high + j, high + i});
    }
  }
}

void append_prism(TriangleMesh& mesh, std::span<const Vec3> polygon, const Vec3& extrusion) {
  const auto n = static_cast<std::uint32_t>(polygon.size());
  HM_CHECK(n >= 3, "polygon of {}", n);
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const Vec3& p : polygon) add(mesh, p);
  for (const Vec3& p : polygon) add(mesh, p + extrusion);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    add_quad(mesh, {first + i, first + j, first + n + j, first + n + i});
  }
  for (std::uint32_t i = 1; i + 1 < n; ++i) {
    mesh.triangles.push_back({first, first + i + 1, first + i});
    mesh.triangles.push_back({first + n, first + n + i, first + n + i + 1});
  }
}

}  // namespace hm
