#pragma once
#include <cstddef>

#include "hm/geometry/triangle_mesh.hpp"
#include "hm/mesh/mesh_params.hpp"

namespace hm {

/// What is too small to keep. A piece is removed if it falls short of either bound.
struct PieceBounds {
  std::size_t min_triangles = 0;
  double min_diameter_m = 0;  ///< diagonal of the box around the piece
};
/// Removes the pieces (triangles joined by shared vertices) that are too small, and vertices that no
/// triangle uses. What stays keeps its order.
TriangleMesh remove_small_pieces(TriangleMesh mesh, const PieceBounds& bounds);

/// How far to simplify: to `keep_ratio` of the triangles, but not beyond an error of `max_error_m`
/// (0: no limit). {1, e}: as far as the error allows.
struct SimplifyTarget {
  double keep_ratio = 1;
  double max_error_m = 0;
};
/// Fewer triangles by quadric edge collapse (meshoptimizer; Garland & Heckbert 1997). Vertices that stay
/// keep position, normal and colour; open borders stay where they are. Returns the mesh unchanged for {1, 0}.
TriangleMesh simplify(TriangleMesh mesh, const SimplifyTarget& target);

/// What MeshParams asks for after meshing: small pieces removed, then simplified.
TriangleMesh clean_mesh(TriangleMesh mesh, const MeshParams& params);

}  // namespace hm
