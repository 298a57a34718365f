#include "hm/pipeline/experiments/mobile/integration_run.hpp"

#include <cmath>

#include "hm/core/stopwatch.hpp"
#include "hm/mesh/whole_mesh.hpp"

namespace hm {

ScanStats IntegrationRun::integrate(const RgbdFrame& frame) {
  const double begin_s = thread_cpu_s();
  ScanStats stats = integrator_.integrate(grid_, frame);
  scan_ms_.push_back(1e3 * (thread_cpu_s() - begin_s));
  return stats;
}

TriangleMesh IntegrationRun::mesh(const ParallelLoop& loop) const { return extract_mesh(grid_, {}, loop); }

void ColorDifference::add(const RgbdFrame& frame) {
  constexpr double kSeen_m = 0.03;
  if (!frame.T_world_camera || frame.color.empty() || mesh_.colors.size() != mesh_.vertices.size()) return;
  const SE3 T_camera_world = frame.T_world_camera->inverse();
  for (std::size_t i = 0; i < mesh_.vertices.size(); ++i) {
    const Vec3 p = T_camera_world * mesh_.vertices[i].cast<double>();
    if (p.z() < kSeen_m) continue;
    const Vec2 pixel = camera_.project(p);
    const int x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
    if (!frame.depth.units.contains(x, y)) continue;
    if (std::abs(frame.depth.depth_m(x, y) - p.z()) > kSeen_m) continue;
    const Rgb8 seen = frame.color(x, y), stored = mesh_.colors[i];
    sum_ += std::abs(seen.r - stored.r) + std::abs(seen.g - stored.g) + std::abs(seen.b - stored.b);
    ++count_;
  }
}

std::vector<Figure> draw_side_by_side(std::span<const CaptionedMesh> meshes, RenderStyle style, int width_px,
                                      const ParallelLoop& loop) {
  std::vector<Figure> figures;
  if (meshes.empty() || meshes.front().mesh->triangles.empty()) return figures;
  RenderOptions options;
  options.width = width_px;
  options.height = width_px * 2 / 3;
  options.style = style;
  const RenderView view = dollhouse_view(scene_extent_along(*meshes.front().mesh, Vec3::UnitZ()), options);
  for (const CaptionedMesh& one : meshes)
    figures.push_back(
        {one.name, one.caption, render_mesh(*one.mesh, view, options, loop), HtmlReport::Place::kHalf});
  return figures;
}

}  // namespace hm
