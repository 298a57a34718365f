#include "hm/report/floor_plan_svg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

namespace hm {
namespace {

constexpr double kPlanWidth_px = 480, kPlanMargin_px = 46, kCutOverFloor_m = 1.4, kTolerance_m = 0.01;

using Line2 = std::vector<Vec2>;
using MeshEdge = std::array<std::uint32_t, 2>;  ///< vertices, the lower first

/// A place where the plane cuts an edge of the mesh, and the one or two others that triangles join it to.
struct CutPoint {
  Vec2 position;
  std::vector<MeshEdge> neighbours;
  bool used = false;
};

/// The points where the mesh meets the plane at this height, in scene axes.
std::map<MeshEdge, CutPoint> cut_points(const TriangleMesh& mesh, const Mat3& to_scene, double height_m) {
  std::map<MeshEdge, CutPoint> points;
  const auto in_scene = [&](std::uint32_t v) -> Vec3 { return to_scene * mesh.vertices[v].cast<double>(); };
  for (const auto& t : mesh.triangles) {
    if (std::max({t[0], t[1], t[2]}) >= mesh.vertices.size()) continue;
    std::vector<MeshEdge> crossed;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t i = std::min(t[k], t[(k + 1) % 3]), j = std::max(t[k], t[(k + 1) % 3]);
      const Vec3 a = in_scene(i), b = in_scene(j);
      if (!a.allFinite() || !b.allFinite() || (a.z() >= height_m) == (b.z() >= height_m)) continue;
      const double share = (height_m - a.z()) / (b.z() - a.z());
      points.try_emplace({i, j}, CutPoint{(a + share * (b - a)).head<2>(), {}, false});
      crossed.push_back({i, j});
    }
    if (crossed.size() != 2) continue;
    points.at(crossed[0]).neighbours.push_back(crossed[1]);
    points.at(crossed[1]).neighbours.push_back(crossed[0]);
  }
  return points;
}

/// Follows the points from one to the next that is not used yet.
void follow(std::map<MeshEdge, CutPoint>& points, CutPoint* point, Line2& line) {
  while (point != nullptr) {
    point->used = true;
    line.push_back(point->position);
    CutPoint* next = nullptr;
    for (const MeshEdge& edge : point->neighbours)
      if (CutPoint& candidate = points.at(edge); !candidate.used) next = &candidate;
    point = next;
  }
}

std::vector<Line2> chains(std::map<MeshEdge, CutPoint> points) {
  std::vector<Line2> lines;
  for (const bool only_ends : {true, false})
    for (auto& [edge, point] : points) {
      if (point.used || (only_ends && point.neighbours.size() != 1)) continue;
      Line2& line = lines.emplace_back();
      follow(points, &point, line);
      // What is left are rings.
      if (!only_ends && line.size() > 2 && !point.neighbours.empty()) line.push_back(line.front());
    }
  return lines;
}

/// Keeps the points that are further than the tolerance from the line between those kept (Douglas & Peucker
/// 1973).
Line2 thinned_line(const Line2& line, double tolerance_m) {
  std::vector<bool> kept(line.size(), false);
  kept.front() = kept.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> todo{{0, line.size() - 1}};
  while (!todo.empty()) {
    const auto [first, last] = todo.back();
    todo.pop_back();
    const Vec2 along = line[last] - line[first];
    double furthest_m = tolerance_m;
    std::size_t at = first;
    for (std::size_t i = first + 1; i < last; ++i) {
      const Vec2 from = line[i] - line[first];
      const double share = std::clamp(from.dot(along) / std::max(along.squaredNorm(), 1e-12), 0.0, 1.0);
      const double distance_m = (from - share * along).norm();
      if (distance_m > furthest_m) furthest_m = distance_m, at = i;
    }
    if (at == first) continue;
    kept[at] = true;
    todo.emplace_back(first, at);
    todo.emplace_back(at, last);
  }
  Line2 out;
  for (std::size_t i = 0; i < line.size(); ++i)
    if (kept[i]) out.push_back(line[i]);
  return out;
}

double length_of(const Line2& line) {
  double length = 0;
  for (std::size_t i = 1; i < line.size(); ++i) length += (line[i] - line[i - 1]).norm();
  return length;
}

/// From metres in scene axes to the drawing.
struct Paper {
  Box3 frame;  ///< what is drawn
  double scale = 1;
  explicit Paper(const Box3& box) : frame(box) {
    const Vec3 size = box.sizes();
    scale = std::min((kPlanWidth_px - kPlanMargin_px - 16) / size.x(), 1.2 * kPlanWidth_px / size.y());
  }
  [[nodiscard]] double left() const { return kPlanMargin_px; }
  [[nodiscard]] double top() const { return 34; }
  [[nodiscard]] double right() const { return left() + scale * frame.sizes().x(); }
  [[nodiscard]] double bottom() const { return top() + scale * frame.sizes().y(); }
  [[nodiscard]] Vec2 at(const Vec2& p) const {
    return {left() + scale * (p.x() - frame.min().x()), bottom() - scale * (p.y() - frame.min().y())};
  }
  [[nodiscard]] std::string path(const Line2& line) const {
    std::string text;
    for (std::size_t i = 0; i < line.size(); ++i) {
      const Vec2 p = at(line[i]);
      text += fmt::format("{}{:.1f} {:.1f}", i == 0 ? 'M' : 'L', p.x(), p.y());
    }
    return text;
  }
};

/// Rows of cells of `step` metres that hold an upward surface below the ceiling.
std::string seen_area(const TriangleMesh& mesh, const SceneExtent& extent, const Paper& paper) {
  const double step = std::max(0.05, 1.0 / paper.scale);
  const Image<std::uint8_t> cells = cells_facing_up(mesh, extent, {paper.frame, step, 4000});
  std::string path;
  for (int y = 0; y < cells.height(); ++y)
    for (int x = 0; x < cells.width(); ++x) {
      if (cells(x, y) == 0) continue;
      int end = x;
      while (end < cells.width() && cells(end, y) != 0) ++end;
      const Vec2 corner = paper.at(paper.frame.min().head<2>() + step * Vec2(x, y + 1));
      path += fmt::format("M{:.1f} {:.1f}h{:.1f}v{:.1f}h{:.1f}z", corner.x(), corner.y(),
                          (end - x) * step * paper.scale, step * paper.scale + 0.1,
                          -(end - x) * step * paper.scale);
      x = end;
    }
  return path;
}

/// A length with its ends marked, along x over the scene or along y at its left.
std::string dimension(const Paper& paper, const Vec2& from, const Vec2& to, bool along_x) {
  const Vec2 a = paper.at(from), b = paper.at(to);
  const double length_m = (to - from).norm();
  if (along_x) {
    const double y = paper.top() - 10;
    return fmt::format(
        "<path class=\"d\" d=\"M{0:.1f} {2:.1f}v8m0 -4H{1:.1f}m0 -4v8\"/>"
        "<text x=\"{3:.1f}\" y=\"{4:.1f}\" text-anchor=\"middle\">{5:.2f} m</text>",
        a.x(), b.x(), y - 4, 0.5 * (a.x() + b.x()), y - 7, length_m);
  }
  const double x = paper.left() - 14;
  return fmt::format(
      "<path class=\"d\" d=\"M{2:.1f} {0:.1f}h8m-4 0V{1:.1f}m-4 0h8\"/>"
      "<text transform=\"translate({3:.1f} {4:.1f}) rotate(-90)\" text-anchor=\"middle\">{5:.2f} m</text>",
      a.y(), b.y(), x - 4, x - 8, 0.5 * (a.y() + b.y()), length_m);
}

std::string scale_bar(const Paper& paper) {
  double length_m = 0.01;
  for (const double next : {0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0})
    if (next * paper.scale <= 0.25 * kPlanWidth_px) length_m = next;
  const double y = paper.bottom() + 22, end = paper.left() + length_m * paper.scale;
  return fmt::format(
      "<path class=\"b\" d=\"M{:.1f} {:.1f}v6H{:.1f}v-6\"/><text x=\"{:.1f}\" y=\"{:.1f}\">{}</text>",
      paper.left(), y, end, end + 8, y + 7,
      length_m >= 1 ? fmt::format("{:g} m", length_m) : fmt::format("{:g} cm", 100 * length_m));
}

std::string open_plan(const Paper& paper) {
  return fmt::format(
      "<svg class=\"hm-plan\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.0f} {:.0f}\" "
      "width=\"100%\" "
      "style=\"max-width:760px;height:auto\" role=\"img\" aria-label=\"floor plan\"><style>"
      ".hm-plan{{font:16px system-ui,-apple-system,'Segoe "
      "UI',Roboto,sans-serif;color:#2a2f3a;--seen:#e3e9f1;--way:#d65420}}"
      ".hm-plan text{{fill:currentColor}}.hm-plan path{{fill:none;stroke:currentColor;stroke-linejoin:round;"
      "stroke-linecap:round}}.hm-plan .s{{fill:var(--seen);stroke:none}}.hm-plan .d{{stroke-opacity:.55}}"
      ".hm-plan .p{{stroke:var(--way);stroke-width:1.6}}.hm-plan .b{{stroke-width:2}}"
      "@media(prefers-color-scheme:dark){{.hm-plan{{color:#dfe3ea;--seen:#2b3440;--way:#ff8a4f}}}}</style>",
      std::max(kPlanWidth_px, paper.right() + 10), paper.bottom() + 40);
}

Line2 path_on_paper(const Trajectory& path, const Mat3& to_scene, const Box3& frame) {
  Line2 line;
  for (const StampedPose& pose : path) {
    const Vec3 p = to_scene * pose.T_world_base.translation();
    if (p.allFinite() && frame.contains(Vec3(p.x(), p.y(), frame.center().z())))
      line.emplace_back(p.head<2>());
  }
  return line;
}

}  // namespace

SceneExtent framed(SceneExtent extent, const Trajectory* path) {
  if (path == nullptr) return extent;
  const Mat3 to_scene = extent.T_world_scene.rotation().transpose();
  const Box3 scene = extent.box;
  const double most_m = scene.sizes().head<2>().maxCoeff();
  for (const StampedPose& pose : *path) {
    Vec3 p = to_scene * pose.T_world_base.translation();
    if (!p.allFinite()) continue;
    p.z() = scene.center().z();
    for (int k = 0; k < 2; ++k) p[k] = std::clamp(p[k], scene.min()[k] - most_m, scene.max()[k] + most_m);
    extent.box.extend(p);
  }
  return extent;
}

std::string floor_plan_svg(const TriangleMesh& mesh, const SceneExtent& extent, const SceneSize& size,
                           const Trajectory* path) {
  if (mesh.triangles.empty()) return {};
  const Mat3 to_scene = extent.T_world_scene.rotation().transpose();
  const Paper paper(framed(extent, path).box);
  double cut_m = extent.floor_m + kCutOverFloor_m;
  if (cut_m > extent.box.max().z()) cut_m = 0.5 * (extent.floor_m + extent.box.max().z());
  std::string walls;
  for (const Line2& line : chains(cut_points(mesh, to_scene, cut_m)))
    if (length_of(line) > 4 * kTolerance_m)
      walls += paper.path(thinned_line(line, std::max(kTolerance_m, 0.4 / paper.scale)));
  std::string svg = open_plan(paper);
  svg += fmt::format("<path class=\"s\" d=\"{}\"/>", seen_area(mesh, extent, paper));
  svg += fmt::format("<path d=\"{}\" stroke-width=\"{:.1f}\"/>", walls,
                     std::clamp(0.05 * paper.scale, 1.4, 5.0));
  if (path != nullptr) {
    const Line2 line = path_on_paper(*path, to_scene, paper.frame);
    if (line.size() > 1) {
      const Vec2 start = paper.at(line.front());
      svg += fmt::format(
          "<path class=\"p\" d=\"{}\"/><circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"var(--way)\"/>",
          paper.path(thinned_line(line, 0.3 / paper.scale)), start.x(), start.y());
    }
  }
  const Vec2 low = extent.box.min().head<2>(), high = extent.box.max().head<2>();
  svg += dimension(paper, low, {high.x(), low.y()}, true) + dimension(paper, low, {low.x(), high.y()}, false);
  svg += scale_bar(paper);
  svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{:.{}f} m\u00b2{}</text></svg>",
                     kPlanWidth_px - 10, paper.bottom() + 29, size.area_m2, size.area_m2 < 10 ? 1 : 0,
                     size.ceiling_m ? fmt::format(", ceiling {:.2f} m", *size.ceiling_m) : std::string());
  return svg;
}

}  // namespace hm
