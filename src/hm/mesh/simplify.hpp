#pragma once
#include <cstddef>

#include "hm/geometry/triangle_mesh.hpp"
#include "hm/mesh/mesh_params.hpp"

namespace hm {

/// Removes the pieces (triangles connected by shared vertices) whose bounding box has a diagonal shorter than
/// `min_size_m`, except the one of most triangles, and unused vertices, preserving the order of the rest.
TriangleMesh remove_small_pieces(TriangleMesh mesh, double min_size_m);

/// Target of simplification: `keep_ratio` of the triangles, with an error of at most `max_error_m` (0: no
/// limit). {1, e}: as far as the error allows.
struct SimplifyTarget {
  double keep_ratio = 1;
  double max_error_m = 0;
};
/// Reduces the number of triangles by quadric edge collapse (meshoptimizer; Garland & Heckbert 1997).
/// Remaining vertices keep position, normal and colour; open borders are preserved. Returns the mesh
/// unchanged for {1, 0}.
TriangleMesh simplify(TriangleMesh mesh, const SimplifyTarget& target);

/// Merges the vertices in each cell of a cubic lattice into their mean (Rossignac & Borrel 1993) and removes
/// triangles that have two corners in one cell. Coarser than simplify(), but reaches any number of triangles,
/// with open borders too. `cell_m` > 0 in metres. The result has no normals; vertices that are not finite are
/// removed with their triangles.
TriangleMesh cluster_vertices(const TriangleMesh& mesh, double cell_m);

/// Reduces the mesh to at most `max_triangles` (at least 1) triangles: by simplify(), then by
/// cluster_vertices() where open borders keep more.
TriangleMesh simplify_to(const TriangleMesh& mesh, std::size_t max_triangles);

/// Removes small pieces, then simplifies, as set in MeshParams.
TriangleMesh clean_mesh(TriangleMesh mesh, const MeshParams& params);

}  // namespace hm
