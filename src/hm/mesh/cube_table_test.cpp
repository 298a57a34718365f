#include "hm/mesh/cube_table.hpp"

#include <gtest/gtest.h>

#include <bitset>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace hm {
namespace {

using Directed = std::pair<int, int>;

int corner_index(const std::array<int, 3>& at) { return at[0] | at[1] << 1 | at[2] << 2; }

bool crossed(int cube_case, int edge) {
  const CubeEdge place = cube_edge(edge);
  const int low = corner_index(place.low), high = low | 1 << place.axis;
  return (cube_case >> low & 1) != (cube_case >> high & 1);
}

/// Directed triangle edges without an opposite: the outline of the surface in the cube.
std::set<Directed> outline(int cube_case) {
  std::multiset<Directed> sides;
  const auto row = static_cast<std::size_t>(cube_case);
  const CubeTable& table = cube_table();
  for (std::size_t t = 0; t < table.triangle_count[row]; ++t)
    for (std::size_t k = 0; k < 3; ++k)
      sides.emplace(table.edges[row][3 * t + k], table.edges[row][3 * t + (k + 1) % 3]);
  std::set<Directed> result;
  for (const Directed& side : sides) {
    EXPECT_EQ(sides.count(side), 1U) << cube_case;
    if (sides.count({side.second, side.first}) == 0) result.insert(side);
  }
  return result;
}

bool on_face(int edge, int axis, int side) {
  const CubeEdge place = cube_edge(edge);
  return place.axis != axis && place.low[static_cast<std::size_t>(axis)] == side;
}

/// The same edge seen from the neighbour across the face (axis, side).
int across(int edge, int axis) {
  for (int other = 0; other < 12; ++other) {
    CubeEdge place = cube_edge(edge);
    place.low[static_cast<std::size_t>(axis)] ^= 1;
    const CubeEdge candidate = cube_edge(other);
    if (candidate.axis == place.axis && candidate.low == place.low) return other;
  }
  return -1;
}

std::set<Directed> outline_on_face(int cube_case, int axis, int side) {
  std::set<Directed> result;
  for (const Directed& s : outline(cube_case))
    if (on_face(s.first, axis, side) && on_face(s.second, axis, side)) result.insert(s);
  return result;
}

TEST(CubeTable, EveryCrossedEdgeIsUsedAndNoOther) {
  for (int cube_case = 0; cube_case < 256; ++cube_case) {
    const auto row = static_cast<std::size_t>(cube_case);
    std::bitset<12> used;
    for (std::size_t k = 0; k < 3U * cube_table().triangle_count[row]; ++k)
      used.set(cube_table().edges[row][k]);
    for (int edge = 0; edge < 12; ++edge)
      EXPECT_EQ(used[static_cast<std::size_t>(edge)], crossed(cube_case, edge)) << cube_case << ' ' << edge;
  }
}

TEST(CubeTable, TheOutlineLiesInFacesAndPassesEachEdgeOnce) {
  for (int cube_case = 0; cube_case < 256; ++cube_case) {
    std::map<int, int> in, out;
    for (const auto& [from, to] : outline(cube_case)) {
      bool in_a_face = false;
      for (int face = 0; face < 6; ++face)
        in_a_face |= on_face(from, face / 2, face % 2) && on_face(to, face / 2, face % 2);
      EXPECT_TRUE(in_a_face) << cube_case;
      ++out[from], ++in[to];
    }
    for (int edge = 0; edge < 12; ++edge) {
      EXPECT_EQ(in[edge], crossed(cube_case, edge) ? 1 : 0);
      EXPECT_EQ(out[edge], crossed(cube_case, edge) ? 1 : 0);
    }
  }
}

TEST(CubeTable, NoTriangleSideInsideTheCubeLiesInAFace) {
  for (int cube_case = 0; cube_case < 256; ++cube_case) {
    const auto row = static_cast<std::size_t>(cube_case);
    const std::set<Directed> border = outline(cube_case);
    for (std::size_t t = 0; t < cube_table().triangle_count[row]; ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const int from = cube_table().edges[row][3 * t + k],
                  to = cube_table().edges[row][3 * t + (k + 1) % 3];
        if (border.count({from, to})) continue;
        for (int face = 0; face < 6; ++face)
          EXPECT_FALSE(on_face(from, face / 2, face % 2) && on_face(to, face / 2, face % 2)) << cube_case;
      }
  }
}

TEST(CubeTable, NeighboursAgreeOnTheirFaceWithOppositeDirection) {
  for (int a = 0; a < 256; ++a)
    for (int b = 0; b < 256; ++b)
      for (int axis = 0; axis < 3; ++axis) {
        bool fits = true;  // b is the neighbour of a at +axis: a's far corners are b's near ones
        for (int corner = 0; corner < 8; ++corner)
          if (!(corner >> axis & 1)) fits &= (a >> (corner | 1 << axis) & 1) == (b >> corner & 1);
        if (!fits) continue;
        std::set<Directed> expected;
        for (const auto& [from, to] : outline_on_face(a, axis, 1))
          expected.emplace(across(to, axis), across(from, axis));
        ASSERT_EQ(outline_on_face(b, axis, 0), expected) << a << ' ' << b << ' ' << axis;
      }
}

TEST(CubeTable, ASingleInsideCornerFacesOutwards) {
  // Inside at the origin: the triangle goes x, y, z, which is counter-clockwise seen from (1, 1, 1).
  ASSERT_EQ(cube_table().triangle_count[1], 1);
  std::array<int, 3> axes{};
  for (std::size_t k = 0; k < 3; ++k) axes[k] = cube_edge(cube_table().edges[1][k]).axis;
  while (axes[0] != 0) axes = {axes[1], axes[2], axes[0]};
  EXPECT_EQ(axes, (std::array<int, 3>{0, 1, 2}));
}

TEST(CubeTable, AnAmbiguousFaceKeepsInsideCornersTogether) {
  // Corners 0 and 3 of the face z = 0 inside: one piece around both, so one outline of six edges.
  EXPECT_EQ(cube_table().triangle_count[0b1001], 4);
  EXPECT_EQ(cube_table().triangle_count[0b0110 ^ 0xff], 2);  // outside corners are cut off one by one
}

}  // namespace
}  // namespace hm
