#pragma once
#include <array>
#include <cstdint>

namespace hm {

/// Edge of a cube. Corner i of a cube lies at (i & 1, i >> 1 & 1, i >> 2). A cube's case has bit i set where
/// corner i is inside (negative distance). Edge e runs along axis e / 4; e % 4 are the low corner's
/// coordinates on the other two axes, the lower axis in the lower bit.
struct CubeEdge {
  int axis = 0;
  std::array<int, 3> low{};  ///< the low corner, 0 or 1 per axis
};
CubeEdge cube_edge(int edge);

/// Triangles of each of the 256 cases.
///
/// The table is derived, not listed. (1) On each face of the cube, line segments join the crossed edges;
/// where a face has inside corners on one diagonal only, the segments connect the two inside corners. This
/// depends on the face only, so the two cubes that share it agree and no crack can appear. (2) The segments,
/// directed with the inside on a fixed side, close into loops. (3) Each loop is triangulated along the
/// shortest diagonals (edge midpoints as vertices), none of which may lie in a face of the cube: so the
/// neighbour cannot have the same diagonal, and every edge of the mesh joins exactly two triangles. Every
/// case has such a triangulation (checked when the table is built), with at most 5 triangles.
struct CubeTable {
  static constexpr int kMaxTriangles = 5;
  std::array<std::uint8_t, 256> triangle_count{};
  /// Edges of the triangles' corners, counter-clockwise seen from outside.
  std::array<std::array<std::uint8_t, 3 * kMaxTriangles>, 256> edges{};
};
/// Returns the table, built on first use; thread safe.
const CubeTable& cube_table();

}  // namespace hm
