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
#include "hm/report/render/mesh_renderer.hpp"

namespace hm {

/// Figure of a mesh.
struct Figure {
  std::string name;     ///< file name without extension: "shaded", "plan"
  std::string caption;  ///< description
  Image<Rgb8> image;
  HtmlReport::Place place = HtmlReport::Place::kWide;
  std::vector<HtmlReport::Swatch> legend = {};  ///< below the figure in a report
  double scale_m = 0, scale_ratio = 0;          ///< a scale bar below it: its length, and share of the width
};

struct MeshFigureOptions {
  int width_px = 1400;
  int height_px = 900;
  const Trajectory* trajectory = nullptr;  ///< drawn into the floor plan
  Vec3 up = Vec3::UnitZ();                 ///< up direction (unit); approximate unless it is known
  bool up_is_known = false;
  std::optional<SE3> T_world_camera;  ///< additional view from this camera pose
  bool is_for_comparison = false;     ///< only by colour (if it has any) and as a floor plan
};

/// Extent of a mesh along the up direction of the options.
SceneExtent extent_of(const TriangleMesh& mesh, const MeshFigureOptions& options);

/// Draws the mesh from above with ceilings removed: shaded, by colour (if it has any), by height, and as a
/// floor plan; from the camera if its pose is given. Empty for an empty mesh.
std::vector<Figure> make_mesh_figures(const TriangleMesh& mesh, const MeshFigureOptions& options,
                                      const ParallelLoop& loop);

/// Draws a heat map of the signed distance of a mesh to the truth.
std::optional<Figure> make_error_figure(const TriangleMesh& mesh, const TriangleMesh& truth,
                                        const MeshFigureOptions& options, const ParallelLoop& loop);

/// Writes figures as PNG to the folder `pictures` in `output`, and adds that folder to `outputs`; without
/// figures no folder is created. An error is the first; the other figures are written nevertheless.
Result<void> write_figures(const std::filesystem::path& output, std::span<const Figure> figures,
                           std::vector<std::filesystem::path>& outputs, const ParallelLoop& loop);

void add_figure(HtmlReport& report, const Figure& figure);
/// Shows the figure of this name in the place of the model; nothing if there is none.
void set_lead_figure(HtmlReport& report, std::span<const Figure> figures, std::string_view name);
/// Adds a section with the histogram of the signed error.
void add_error_histogram(HtmlReport& report, const MeshError& error);

}  // namespace hm
