#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/report/mesh_pictures.hpp"
#include "hm/mapping/mapping_params.hpp"

namespace hm {

/// Writes mesh.ply, mesh.glb ... as reconstruction.mesh_formats asks, and names them in `outputs`.
struct MeshFiles {
  std::filesystem::path folder;
  std::string program_version;
};
Result<void> write_mesh_files(const TriangleMesh& mesh, const MeshFiles& files,
                              const ReconstructionParams& params,
                              std::vector<std::filesystem::path>& outputs);

/// How a mesh is drawn that this camera made on this way. The trajectory must outlive the options.
MeshPictureOptions picture_options(const PinholeCamera& camera, const Trajectory& trajectory);

}  // namespace hm
