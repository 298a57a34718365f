#pragma once
#include <array>
#include <cstdint>

namespace hm {

/// Corner i of a cube lies at (i & 1, i >> 1 & 1, i >> 2). A cube's case has bit i set where corner i is
/// inside (negative distance). Edge e runs along axis e / 4; e % 4 are the low corner's coordinates on the
/// other two axes, the lower axis in the lower bit.
struct CubeEdge {
  int axis = 0;
  std::array<int, 3> low{};  ///< the low corner, 0 or 1 per axis
};
CubeEdge cube_edge(int edge);

/// Which triangles each of the 256 cases has.
///
/// The table is derived, not listed. (1) On each face of the cube, line segments join the crossed edges;
/// where a face has inside corners on one diagonal only, the segments keep the two inside corners together.
/// This looks at the face alone, so the two cubes that share it agree and no crack can appear.
/// (2) The segments, directed with the inside on a fixed side, close into loops. (3) Each loop is cut into
/// triangles along the shortest diagonals (edge midpoints as vertices), of which none may lie in a face of
/// the cube: so the neighbour cannot have the same diagonal, and every edge of the mesh joins exactly two
/// triangles. Every case has such a cut (checked when the table is built), with at most 5 triangles.
struct CubeTable {
  static constexpr int kMaxTriangles = 5;
  std::array<std::uint8_t, 256> triangle_count{};
  /// Edges of the triangles' corners, counter-clockwise seen from outside.
  std::array<std::array<std::uint8_t, 3 * kMaxTriangles>, 256> edges{};
};
/// The table, built when first used.
const CubeTable& cube_table();

}  // namespace hm
