#pragma once
#include <cstdint>

#include "hm/mesh/mesh_params.hpp"
#include "hm/mesh/volume_mesh.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {

/// Minimum voxel weight (TsdfVoxel::weight()) of observed voxels; at least 1.
std::uint16_t min_voxel_weight(const MeshParams& params);

/// Computes the mesh of one volume by marching cubes (dissertation 4.4; Lorensen & Cline 1987 with the table
/// of cube_table.hpp).
///
/// Meshes the cubes whose low corner is a voxel of the volume and whose 8 corners have at least `min_weight`;
/// the far corners come from the neighbours. Negative distances are inside. Normals are central differences
/// of the distance at both ends of a vertex's edge, interpolated; one-sided where a neighbour is unknown.
/// Colours are interpolated between the ends with colour; neutral grey without any. Vectorised (Highway),
/// bit-identical on every instruction set; thread safe while the grid does not change.
VolumeMesh mesh_volume(const VolumeGrid& grid, const Volume& volume, std::uint16_t min_weight);

}  // namespace hm
