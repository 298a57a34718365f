#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/geometry/level/up_direction.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/mapping/mapping_params.hpp"
#include "hm/report/mesh_figures.hpp"

namespace hm {

/// Writes mesh.ply, mesh.glb ... in the formats of reconstruction.mesh_formats, and adds them to `outputs`.
struct MeshFiles {
  std::filesystem::path folder;
  std::string program_version;
  UpDirection up;  ///< in the mesh's frame
};
Result<void> write_mesh_files(const TriangleMesh& mesh, const MeshFiles& files,
                              const ReconstructionParams& params,
                              std::vector<std::filesystem::path>& outputs);

/// Drawing options of a mesh that this camera made on this way; up by the camera where it is unknown. The
/// trajectory must outlive the options.
MeshFigureOptions figure_options(const PinholeCamera& camera, const Trajectory& trajectory,
                                 const UpDirection& up = {});

}  // namespace hm
