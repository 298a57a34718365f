#pragma once
#include <cstdint>

#include "hm/mesh/mesh_params.hpp"
#include "hm/mesh/volume_mesh.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {

/// The least voxel weight (TsdfVoxel::weight()) that counts as observed; at least 1.
std::uint16_t min_voxel_weight(const MeshParams& params);

/// The mesh of one volume (dissertation 4.4; Lorensen & Cline 1987 with the table of cube_table.hpp).
///
/// Meshes the cubes whose low corner is a voxel of the volume and whose 8 corners weigh at least
/// `min_weight`; the far corners come from the neighbours. Inside is where the distance is negative.
/// Normals are central differences of the distance at both ends of a vertex's edge, interpolated; where a
/// neighbour is unknown, one-sided. Colours are interpolated between the ends that have one; where none
/// has, neutral grey. Vectorised (Highway), the same bits on every instruction set; thread safe as long
/// as nobody changes the grid.
VolumeMesh mesh_volume(const VolumeGrid& grid, const Volume& volume, std::uint16_t min_weight);

}  // namespace hm
