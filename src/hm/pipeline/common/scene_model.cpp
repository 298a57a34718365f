#include "hm/pipeline/common/scene_model.hpp"

#include "hm/core/process_memory.hpp"
#include "hm/evaluation/mesh_error.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/mesh/simplify.hpp"
#include "hm/report/floor_plan_svg.hpp"
#include "hm/report/model_view.hpp"

namespace hm {
namespace {

/// Triangles that fit into kMaxModelBytes as a rule; a view that is larger is made again of fewer.
constexpr std::size_t kFirstTriangles = 150'000;

std::string fitting_model_html(ModelView view, const TriangleMesh& mesh, const SurfaceDistance* truth,
                               const ParallelLoop& loop) {
  std::size_t triangles = kFirstTriangles;
  for (int attempt = 0; attempt < 5; ++attempt) {
    view.mesh = simplify_to(attempt == 0 ? mesh : view.mesh, triangles);
    if (truth != nullptr) view.errors_m = vertex_errors_m(view.mesh, *truth, loop);
    std::string html = model_view_html(view);
    if (html.size() <= kMaxModelBytes) return html;
    triangles = std::max<std::size_t>(
        1, static_cast<std::size_t>(0.95 * static_cast<double>(view.mesh.triangles.size()) *
                                    static_cast<double>(kMaxModelBytes) / static_cast<double>(html.size())));
  }
  return {};
}

}  // namespace

SceneModel make_scene_model(const TriangleMesh& mesh, const MeshFigureOptions& options,
                            const TriangleMesh* truth, const ParallelLoop& loop) {
  SceneModel scene;
  if (mesh.triangles.empty()) return scene;
  ModelView view;
  view.extent = extent_of(mesh, options);
  if (options.trajectory != nullptr) view.path = path_points(*options.trajectory);
  scene.size = scene_size(mesh, view.extent);
  scene.plan_svg = floor_plan_svg(mesh, view.extent, *scene.size, options.trajectory);
  std::optional<SurfaceDistance> distance;
  if (truth != nullptr)
    if (auto built = SurfaceDistance::build(*truth)) distance.emplace(std::move(*built));
  scene.model_html = fitting_model_html(std::move(view), mesh, distance ? &*distance : nullptr, loop);
  trim_memory();
  return scene;
}

Result<void> write_floor_plan(const SceneModel& scene, const std::filesystem::path& folder,
                              std::vector<std::filesystem::path>& outputs) {
  if (scene.plan_svg.empty()) return {};
  if (const auto written = write_file_text(folder / "floor_plan.svg", scene.plan_svg + "\n"); !written)
    return written;
  outputs.push_back(folder / "floor_plan.svg");
  return {};
}

void add_floor_plan(HtmlReport& report, const SceneModel& scene) {
  if (scene.plan_svg.empty()) return;
  report.add_svg(scene.plan_svg,
                 "Floor plan: lines are what stands 1.4 m over the floor, tinted is the floor and what "
                 "stands on it, with "
                 "the camera's path. Also as floor_plan.svg.");
}

}  // namespace hm
