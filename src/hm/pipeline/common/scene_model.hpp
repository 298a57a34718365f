#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/core/result.hpp"
#include "hm/report/mesh_figures.hpp"
#include "hm/report/scene_size.hpp"

namespace hm {

/// Interactive view, floor plan and size of a mesh, for a report.
struct SceneModel {
  std::string model_html;         ///< the view to turn (HtmlReport::set_model), at most kMaxModelBytes
  std::string plan_svg;           ///< the floor plan as lines
  std::optional<SceneSize> size;  ///< nothing for an empty mesh
};

/// Simplifies the mesh until its view fits into kMaxModelBytes; up, path as in the figures' options. `truth`:
/// vertices of the simplified mesh get their signed distance to it. Empty for an empty mesh.
SceneModel make_scene_model(const TriangleMesh& mesh, const MeshFigureOptions& options,
                            const TriangleMesh* truth, const ParallelLoop& loop);

/// Writes floor_plan.svg, if there is a plan, and adds it to `outputs`.
Result<void> write_floor_plan(const SceneModel& scene, const std::filesystem::path& folder,
                              std::vector<std::filesystem::path>& outputs);
/// Adds the plan as a plot; nothing without one.
void add_floor_plan(HtmlReport& report, const SceneModel& scene);

}  // namespace hm
