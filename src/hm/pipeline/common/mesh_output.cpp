#include "hm/pipeline/common/mesh_output.hpp"

#include <numbers>

#include "hm/io/mesh/mesh_file.hpp"
#include "hm/report/render/mesh_renderer.hpp"

namespace hm {

Result<void> write_mesh_files(const TriangleMesh& mesh, const MeshFiles& files,
                              const ReconstructionParams& params,
                              std::vector<std::filesystem::path>& outputs) {
  const auto formats = mesh_formats(params);
  if (!formats) return forward_error(formats);
  MeshWriteOptions write;
  write.program = "housemartin " + files.program_version;
  write.up = files.up;
  for (const std::string& format : *formats) {
    const auto path = files.folder / ("mesh." + format);
    if (const auto written = write_mesh(path, mesh, write); !written) return written;
    outputs.push_back(path);
  }
  return {};
}

MeshFigureOptions figure_options(const PinholeCamera& camera, const Trajectory& trajectory,
                                 const UpDirection& up) {
  MeshFigureOptions draw;
  draw.trajectory = &trajectory;
  draw.up_is_known = up.known();
  draw.up = up.known() ? up.up : up_of_cameras(trajectory);
  if (trajectory.empty()) return draw;
  draw.T_world_camera = trajectory[trajectory.size() / 2].T_world_base;
  if (camera.fy < 0) {
    // The figure is turned over: the camera's y axis points up (ICL-NUIM).
    if (!up.known()) draw.up = -draw.up;
    draw.T_world_camera = *draw.T_world_camera * SE3(so3_exp(Vec3(0, 0, std::numbers::pi)), Vec3::Zero());
  }
  return draw;
}

}  // namespace hm
