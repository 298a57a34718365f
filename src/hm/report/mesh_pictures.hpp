#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/core/result.hpp"
#include "hm/report/html_report.hpp"
#include "hm/evaluation/mesh_error.hpp"
#include "hm/geometry/image.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/geometry/triangle_mesh.hpp"

namespace hm {

/// A picture that the program made of a mesh.
struct MeshPicture {
  std::string name;     ///< file name without extension: "shaded", "plan"
  std::string caption;  ///< what it shows
  Image<Rgb8> image;
};

struct MeshPictureOptions {
  int width_px = 1400;
  int height_px = 900;
  const Trajectory* trajectory = nullptr;  ///< drawn into the floor plan
  Vec3 up = Vec3::UnitZ();                 ///< roughly
  std::optional<SE3> T_world_camera;       ///< a place of the camera to draw the mesh from, too
};

/// The mesh from above into its rooms: shaded, by colour (when it has one), by height, and as a floor
/// plan. Nothing for an empty mesh.
std::vector<MeshPicture> make_mesh_pictures(const TriangleMesh& mesh, const MeshPictureOptions& options,
                                            const ParallelLoop& loop);

/// The heat-map of the signed distance of a mesh to the truth.
std::optional<MeshPicture> make_error_picture(const TriangleMesh& mesh, const TriangleMesh& truth,
                                              const MeshPictureOptions& options, const ParallelLoop& loop);

/// Writes them as PNG into the folder `pictures` in `output`, and adds that folder to `outputs`; no pictures,
/// no folder.
Result<void> write_pictures(const std::filesystem::path& output, std::span<const MeshPicture> pictures,
                            std::vector<std::filesystem::path>& outputs);

void add_picture(HtmlReport& report, const MeshPicture& picture);
/// A section with the histogram of the signed error.
void add_error_histogram(HtmlReport& report, const MeshError& error);

}  // namespace hm
