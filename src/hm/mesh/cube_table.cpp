#include "hm/mesh/cube_table.hpp"

#include <cstdlib>
#include <limits>
#include <optional>
#include <vector>

#include "hm/core/check.hpp"

namespace hm {
namespace {

using Loop = std::vector<int>;        // edges
using Face = std::array<int, 4>;      // corners, counter-clockwise seen from outside the cube
using Triangle = std::array<int, 3>;  // indices in a loop

int edge_between(int corner_a, int corner_b) {
  const int axis = (corner_a ^ corner_b) >> 1;  // 1, 2, 4 -> 0, 1, 2
  const int low = corner_a & corner_b;
  const int first = axis == 0 ? 1 : 0, second = axis == 2 ? 1 : 2;
  return axis * 4 + (low >> first & 1) + 2 * (low >> second & 1);
}

std::array<Face, 6> cube_faces() {
  std::array<Face, 6> faces{};
  for (int axis = 0; axis < 3; ++axis) {
    const int a = 1 << axis, b = 1 << (axis + 1) % 3, c = 1 << (axis + 2) % 3;
    faces[static_cast<std::size_t>(2 * axis)] = {0, c, b | c, b};
    faces[static_cast<std::size_t>(2 * axis + 1)] = {a, a | b, a | b | c, a | c};
  }
  return faces;
}

/// Bit f set where face f (2 * axis + side) holds the edge.
unsigned faces_of(int edge) {
  const CubeEdge place = cube_edge(edge);
  unsigned faces = 0;
  for (int axis = 0; axis < 3; ++axis)
    if (axis != place.axis) faces |= 1u << (2 * axis + place.low[static_cast<std::size_t>(axis)]);
  return faces;
}

/// Step (1) for one face: going around it, joins each crossing into the inside with the preceding one out of
/// it, so that all inside corners of the face stay connected.
void join_on_face(const Face& face, int cube_case, std::array<int, 12>& next) {
  const auto inside = [&](std::size_t place) { return (cube_case >> face[place % 4] & 1) != 0; };
  const auto edge_at = [&](std::size_t place) {
    return edge_between(face[place % 4], face[(place + 1) % 4]);
  };
  for (std::size_t in = 0; in < 4; ++in) {
    if (inside(in) || !inside(in + 1)) continue;
    std::size_t out = in + 3;  // one step back around the face
    while (!(inside(out) && !inside(out + 1))) --out;
    next[static_cast<std::size_t>(edge_at(in))] = edge_at(out);
  }
}

std::vector<Loop> surface_loops(int cube_case) {
  std::array<int, 12> next{};
  next.fill(-1);
  for (const Face& face : cube_faces()) join_on_face(face, cube_case, next);
  std::vector<Loop> loops;
  std::array<bool, 12> seen{};
  for (int start = 0; start < 12; ++start) {
    if (next[static_cast<std::size_t>(start)] < 0 || seen[static_cast<std::size_t>(start)]) continue;
    Loop& loop = loops.emplace_back();
    for (int edge = start; !seen[static_cast<std::size_t>(edge)];
         edge = next[static_cast<std::size_t>(edge)]) {
      seen[static_cast<std::size_t>(edge)] = true;
      loop.push_back(edge);
    }
  }
  return loops;
}

/// Squared length of a diagonal in half cube edges; nothing if it lies in a face.
std::optional<int> diagonal_cost(int edge_a, int edge_b) {
  if (faces_of(edge_a) & faces_of(edge_b)) return std::nullopt;
  const CubeEdge a = cube_edge(edge_a), b = cube_edge(edge_b);
  int cost = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const int difference = 2 * a.low[i] + (a.axis == axis) - 2 * b.low[i] - (b.axis == axis);
    cost += difference * difference;
  }
  return cost;
}

struct Cut {
  int cost = 0;
  std::vector<Triangle> triangles;
};

/// Step (3): cheapest triangulation of loop[first..last], given that first-last is an edge.
std::optional<Cut> cut_polygon(const Loop& loop, int first, int last) {
  if (last - first < 2) return Cut{};
  const auto side_cost = [&](int i, int j) -> std::optional<int> {
    if (j - i == 1) return 0;
    return diagonal_cost(loop[static_cast<std::size_t>(i)], loop[static_cast<std::size_t>(j)]);
  };
  std::optional<Cut> best;
  for (int middle = first + 1; middle < last; ++middle) {
    const auto left_cost = side_cost(first, middle), right_cost = side_cost(middle, last);
    if (!left_cost || !right_cost) continue;
    const auto left = cut_polygon(loop, first, middle), right = cut_polygon(loop, middle, last);
    if (!left || !right) continue;
    const int cost = *left_cost + *right_cost + left->cost + right->cost;
    if (best && best->cost <= cost) continue;
    best = Cut{cost, left->triangles};
    best->triangles.push_back({first, middle, last});
    best->triangles.insert(best->triangles.end(), right->triangles.begin(), right->triangles.end());
  }
  return best;
}

CubeTable build_cube_table() {
  CubeTable table;
  for (int cube_case = 0; cube_case < 256; ++cube_case) {
    const auto row = static_cast<std::size_t>(cube_case);
    std::size_t corners = 0;
    for (const Loop& loop : surface_loops(cube_case)) {
      const auto cut = cut_polygon(loop, 0, static_cast<int>(loop.size()) - 1);
      HM_CHECK(cut, "case {} has a loop that cannot be cut", cube_case);
      for (const Triangle& triangle : cut->triangles)
        for (const int place : triangle) {
          HM_CHECK(corners < table.edges[row].size(), "case {} has too many triangles", cube_case);
          table.edges[row][corners++] = static_cast<std::uint8_t>(loop[static_cast<std::size_t>(place)]);
        }
    }
    table.triangle_count[row] = static_cast<std::uint8_t>(corners / 3);
  }
  return table;
}

}  // namespace

CubeEdge cube_edge(int edge) {
  HM_CHECK(edge >= 0 && edge < 12, "edge {}", edge);
  const int axis = edge / 4;
  const std::size_t first = axis == 0 ? 1 : 0, second = axis == 2 ? 1 : 2;
  CubeEdge result{axis, {}};
  result.low[first] = edge & 1;
  result.low[second] = edge >> 1 & 1;
  return result;
}

const CubeTable& cube_table() {
  static const CubeTable table = build_cube_table();
  return table;
}

}  // namespace hm
