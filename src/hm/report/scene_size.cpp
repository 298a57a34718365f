#include "hm/report/scene_size.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

constexpr double kCell_m = 0.05;

/// Large triangles leave cells empty between them.
bool is_covered(const Image<std::uint8_t>& cells, int x, int y) {
  if (cells(x, y) != 0) return true;
  const auto at = [&](int u, int v) { return cells.contains(u, v) && cells(u, v) != 0; };
  return (at(x - 1, y) && at(x + 1, y)) || (at(x, y - 1) && at(x, y + 1));
}

}  // namespace

Image<std::uint8_t> cells_facing_up(const TriangleMesh& mesh, const SceneExtent& extent,
                                    const CellGrid& grid) {
  const Mat3 to_scene = extent.T_world_scene.rotation().transpose();
  const Vec3 size = grid.box.sizes() / grid.cell_m;
  if (!(size.maxCoeff() < grid.most_cells)) return {};
  Image<std::uint8_t> cells(static_cast<int>(size.x()) + 1, static_cast<int>(size.y()) + 1, 0);
  const double top_m = extent.ceiling_m ? *extent.ceiling_m - 0.3 : grid.box.max().z();
  for (const auto& t : mesh.triangles) {
    if (std::max({t[0], t[1], t[2]}) >= mesh.vertices.size()) continue;
    const Vec3 a = mesh.vertices[t[0]].cast<double>(), b = mesh.vertices[t[1]].cast<double>(),
               c = mesh.vertices[t[2]].cast<double>();
    const Vec3 normal = (b - a).cross(c - a), p = to_scene * (a + b + c) / 3;
    if (!(normal.dot(extent.up) > 0.5 * normal.norm()) || !grid.box.contains(p) || p.z() > top_m) continue;
    const Vec3 cell = (p - grid.box.min()) / grid.cell_m;
    cells(static_cast<int>(cell.x()), static_cast<int>(cell.y())) = 1;
  }
  return cells;
}

SceneSize scene_size(const TriangleMesh& mesh, const SceneExtent& extent) {
  SceneSize size;
  if (mesh.triangles.empty()) return size;
  const Vec3 box = extent.box.sizes();
  size.length_m = box.x(), size.width_m = box.y(), size.height_m = box.z();
  if (extent.ceiling_m) size.ceiling_m = *extent.ceiling_m - extent.floor_m;
  const Image<std::uint8_t> cells = cells_facing_up(mesh, extent, {extent.box, kCell_m, 2e4});
  std::size_t covered = 0;
  for (int y = 0; y < cells.height(); ++y)
    for (int x = 0; x < cells.width(); ++x) covered += is_covered(cells, x, y) ? 1 : 0;
  size.area_m2 = static_cast<double>(covered) * kCell_m * kCell_m;
  return size;
}

std::string to_text(const SceneSize& size) {
  return fmt::format("{:.1f} \u00d7 {:.1f} m, {:.1f} m high, {:.{}f} m\u00b2 seen from above", size.length_m,
                     size.width_m, size.height_m, size.area_m2, size.area_m2 < 10 ? 1 : 0);
}

}  // namespace hm
