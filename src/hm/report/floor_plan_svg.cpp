#include "hm/report/floor_plan_svg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "hm/core/angle.hpp"

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

std::string open_plan(const Paper& paper, double more_px = 0) {
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
      std::max(kPlanWidth_px, paper.right() + 10), paper.bottom() + 40 + more_px);
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

namespace {

/// The walls, where the plane of the plan cuts them.
std::string walls_of(const TriangleMesh& mesh, const SceneExtent& extent, const Paper& paper) {
  const Mat3 to_scene = extent.T_world_scene.rotation().transpose();
  double cut_m = extent.floor_m + kCutOverFloor_m;
  if (cut_m > extent.box.max().z()) cut_m = 0.5 * (extent.floor_m + extent.box.max().z());
  std::string walls;
  for (const Line2& line : chains(cut_points(mesh, to_scene, cut_m)))
    if (length_of(line) > 4 * kTolerance_m)
      walls += paper.path(thinned_line(line, std::max(kTolerance_m, 0.4 / paper.scale)));
  return fmt::format("<path d=\"{}\" stroke-width=\"{:.1f}\"/>", walls,
                     std::clamp(0.05 * paper.scale, 1.4, 5.0));
}

}  // namespace

std::string floor_plan_svg(const TriangleMesh& mesh, const SceneExtent& extent, const SceneSize& size,
                           const Trajectory* path) {
  if (mesh.triangles.empty()) return {};
  const Mat3 to_scene = extent.T_world_scene.rotation().transpose();
  const Paper paper(framed(extent, path).box);
  std::string svg = open_plan(paper);
  svg += fmt::format("<path class=\"s\" d=\"{}\"/>", seen_area(mesh, extent, paper));
  svg += walls_of(mesh, extent, paper);
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

namespace {

constexpr double kStrip_px = 74;  ///< of the height over time, below a plan

/// Where a flying vehicle is on paper, at equal steps of time.
struct FlightOnPaper {
  std::vector<Vec2> place;
  std::vector<double> turn_deg, height_m;  ///< clockwise on paper
};

FlightOnPaper flight_on_paper(const Trajectory& path, const Mat3& to_scene, const Paper& paper) {
  constexpr int kSteps = 240;
  FlightOnPaper flight;
  const Duration length = path.back().stamp - path.front().stamp;
  std::size_t next = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const Time now = path.front().stamp + Duration{length.ns / kSteps * i};
    while (next + 1 < path.size() && path[next].stamp < now) ++next;
    const SE3& pose = path[next].T_world_base;
    const Vec3 p = to_scene * pose.translation(), ahead = to_scene * pose.rotation().col(0);
    flight.place.push_back(paper.at(p.head<2>()));
    flight.height_m.push_back(p.z());
    double turn_deg = -std::atan2(ahead.y(), ahead.x()) * kDegreesPerRadian;
    if (i > 0) turn_deg -= 360 * std::round((turn_deg - flight.turn_deg.back()) / 360);
    flight.turn_deg.push_back(turn_deg);
  }
  return flight;
}

/// An endless animation of a transform through these values.
std::string moved(const char* type, const std::vector<std::string>& values, double playback_s) {
  return fmt::format(
      "<animateTransform attributeName=\"transform\" type=\"{}\" dur=\"{:.1f}s\" repeatCount=\"indefinite\" "
      "values=\"{}\"/>",
      type, playback_s, fmt::join(values, ";"));
}

/// The vehicle from above, its front to the right, about 0.7 m large.
std::string vehicle(const FlightOnPaper& flight, const Paper& paper, double playback_s) {
  std::vector<std::string> places, turns;
  for (std::size_t i = 0; i < flight.place.size(); ++i) {
    places.push_back(fmt::format("{:.1f} {:.1f}", flight.place[i].x(), flight.place[i].y()));
    turns.push_back(fmt::format("{:.0f}", flight.turn_deg[i]));
  }
  const double arm = std::max(5.0, 0.25 * paper.scale), rotor = 0.55 * arm;
  std::string rotors;
  for (const auto& [x, y] : {std::pair{1, 0}, {0, 1}, {-1, 0}, {0, -1}})
    rotors += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\"/>", x * arm, y * arm, rotor);
  return fmt::format(
      "<g transform=\"translate({0})\">{1}<g transform=\"rotate({2})\">{3}<g fill=\"var(--way)\" "
      "fill-opacity=\".45\" stroke=\"var(--way)\">{4}</g><path d=\"M{5:.1f} 0l{6:.1f} {7:.1f}v-{8:.1f}z\" "
      "style=\"fill:var(--way);stroke:none\"/></g></g>",
      places.front(), moved("translate", places, playback_s), turns.front(),
      moved("rotate", turns, playback_s), rotors, 1.9 * arm, -0.5 * arm, 0.35 * arm, 0.7 * arm);
}

/// Height over time, with a point that runs along.
std::string height_strip(const FlightOnPaper& flight, const Paper& paper, double playback_s) {
  const double top = paper.bottom() + 52, bottom = top + kStrip_px - 24, width = paper.right() - paper.left();
  const double highest = std::max(0.5, *std::ranges::max_element(flight.height_m));
  std::string line;
  std::vector<std::string> places;
  for (std::size_t i = 0; i < flight.height_m.size(); ++i) {
    const double x =
        paper.left() + width * static_cast<double>(i) / static_cast<double>(flight.height_m.size() - 1);
    const double y = bottom - (bottom - top) * std::max(0.0, flight.height_m[i]) / highest;
    places.push_back(fmt::format("{:.1f} {:.1f}", x, y));
    line += (i == 0 ? "M" : "L") + places.back();
  }
  return fmt::format(
      "<path class=\"d\" d=\"M{0:.1f} {1:.1f}H{2:.1f}\"/><path class=\"p\" d=\"{3}\"/><circle r=\"4\" "
      "fill=\"var(--way)\" transform=\"translate({4})\">{5}</circle><text x=\"{6:.1f}\" y=\"{7:.1f}\" "
      "text-anchor=\"end\">{8:.1f}</text><text x=\"{6:.1f}\" y=\"{1:.1f}\" text-anchor=\"end\">0</text>",
      paper.left(), bottom, paper.right(), line, places.front(), moved("translate", places, playback_s),
      paper.left() - 6, top + 8, highest);
}

}  // namespace

std::string flight_plan_svg(const TriangleMesh& mesh, const SceneExtent& extent, const PlanFlight& flight) {
  if (mesh.triangles.empty() || flight.path == nullptr || flight.path->size() < 2) return {};
  const Mat3 to_scene = extent.T_world_scene.rotation().transpose();
  const Paper paper(framed(extent, flight.path).box);
  std::string svg = open_plan(paper, kStrip_px + 16) + walls_of(mesh, extent, paper);
  for (const Vec3& goal : flight.way_points) {
    const Vec2 p = paper.at((to_scene * goal).head<2>());
    svg += fmt::format("<path class=\"b\" d=\"M{:.1f} {:.1f}l8 8m0 -8l-8 8\"/>", p.x() - 4, p.y() - 4);
  }
  const Line2 line = path_on_paper(*flight.path, to_scene, paper.frame);
  if (line.size() > 1)
    svg += fmt::format("<path class=\"p\" d=\"{}\"/>", paper.path(thinned_line(line, 0.3 / paper.scale)));
  const FlightOnPaper on_paper = flight_on_paper(*flight.path, to_scene, paper);
  svg += scale_bar(paper) + height_strip(on_paper, paper, flight.playback_s);
  return svg + vehicle(on_paper, paper, flight.playback_s) + "</svg>";
}

}  // namespace hm
