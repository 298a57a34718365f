#pragma once
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "hm/core/rng.hpp"
#include "hm/geometry/triangle_mesh.hpp"

namespace hm::test {

enum class Parts { kBare, kNormals, kColors, kAll };
inline constexpr std::array kAllParts{Parts::kBare, Parts::kNormals, Parts::kColors, Parts::kAll};

/// A wavy sheet whose vertices, normals and colours are all different from each other.
inline TriangleMesh make_sheet(int side, Parts parts) {
  TriangleMesh mesh;
  Rng rng(11);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const double z = std::sin(x * 0.7) * std::cos(y * 0.3) + 0.001 * rng.normal();
      mesh.vertices.emplace_back(Vec3(x * 0.1 - 3, y * 0.1 + 7, z).cast<float>());
      mesh.colors.push_back({static_cast<std::uint8_t>(x * 7), static_cast<std::uint8_t>(y * 5),
                             static_cast<std::uint8_t>(rng.below(256))});
    }
  for (int y = 0; y + 1 < side; ++y)
    for (int x = 0; x + 1 < side; ++x) {
      const auto i = static_cast<std::uint32_t>(y * side + x), s = static_cast<std::uint32_t>(side);
      mesh.triangles.push_back({i, i + 1, i + s + 1});
      mesh.triangles.push_back({i, i + s + 1, i + s});
    }
  compute_normals(mesh);
  if (parts == Parts::kBare || parts == Parts::kColors) mesh.normals.clear();
  if (parts == Parts::kBare || parts == Parts::kNormals) mesh.colors.clear();
  return mesh;
}

inline void expect_same(const TriangleMesh& a, const TriangleMesh& b) {
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.normals, b.normals);
  EXPECT_EQ(a.colors, b.colors);
  EXPECT_EQ(a.triangles, b.triangles);
}

}  // namespace hm::test
