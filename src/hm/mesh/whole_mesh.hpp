#pragma once
#include <span>

#include "hm/core/parallel.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/mesh/mesh_params.hpp"
#include "hm/mesh/volume_mesh.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {

/// One mesh out of the meshes of volumes, vertices on volume borders welded by their edge (exact, no
/// tolerance). `volumes` is strictly ascending in ScanOrder, none of them empty. Colours are there if
/// any volume has some. The same bits for any number of threads. Besides the result it takes a few bytes per
/// border vertex and volume.
TriangleMesh weld(std::span<const VolumeMesh* const> volumes, double voxel_size_m, const ParallelLoop& loop);

/// The mesh of a whole grid from scratch; equal to what an IncrementalMesher holds when nothing waits.
TriangleMesh extract_mesh(const VolumeGrid& grid, const MeshParams& params, const ParallelLoop& loop);

}  // namespace hm
