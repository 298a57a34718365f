#pragma once
#include <span>

#include "hm/core/parallel.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/mesh/mesh_params.hpp"
#include "hm/mesh/volume_mesh.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {

/// Merges the meshes of volumes into one, welding vertices on volume borders by their edge (exact, no
/// tolerance). `volumes` must be strictly ascending in ScanOrder and non-empty. The result has colours if any
/// volume has. Bit-identical for any number of threads. Temporary memory: a few bytes per border vertex and
/// volume.
TriangleMesh weld(std::span<const VolumeMesh* const> volumes, double voxel_size_m, const ParallelLoop& loop);

/// Computes the mesh of a whole grid from scratch; equal to that of an IncrementalMesher with an empty queue.
TriangleMesh extract_mesh(const VolumeGrid& grid, const MeshParams& params, const ParallelLoop& loop);

}  // namespace hm
