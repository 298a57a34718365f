#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/core/result.hpp"
#include "hm/evaluation/mesh_error.hpp"
#include "hm/geometry/image.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/report/html_report.hpp"

namespace hm {

/// A figure that the program made of a mesh.
struct Figure {
  std::string name;     ///< file name without extension: "shaded", "plan"
  std::string caption;  ///< what it shows
  Image<Rgb8> image;
};

struct MeshFigureOptions {
  int width_px = 1400;
  int height_px = 900;
  const Trajectory* trajectory = nullptr;  ///< drawn into the floor plan
  Vec3 up = Vec3::UnitZ();                 ///< roughly
  std::optional<SE3> T_world_camera;       ///< a place of the camera to draw the mesh from, too
};

/// The mesh from above into its rooms: shaded, by colour (when it has one), by height, and as a floor
/// plan. Nothing for an empty mesh.
std::vector<Figure> make_mesh_figures(const TriangleMesh& mesh, const MeshFigureOptions& options,
                                      const ParallelLoop& loop);

/// The heat-map of the signed distance of a mesh to the truth.
std::optional<Figure> make_error_figure(const TriangleMesh& mesh, const TriangleMesh& truth,
                                        const MeshFigureOptions& options, const ParallelLoop& loop);

/// Writes them as PNG into the folder `pictures` in `output`, and adds that folder to `outputs`; no figures,
/// no folder.
Result<void> write_figures(const std::filesystem::path& output, std::span<const Figure> figures,
                           std::vector<std::filesystem::path>& outputs);

void add_figure(HtmlReport& report, const Figure& figure);
/// A section with the histogram of the signed error.
void add_error_histogram(HtmlReport& report, const MeshError& error);

}  // namespace hm
