#include <algorithm>
#include <cmath>

#include "hm/report/render/figure.hpp"

namespace hm {
namespace {

constexpr Rgb8 kWallColor{52, 58, 70};
constexpr double kWallLine_m = 0.035;   ///< thickness of a cut surface
constexpr double kWallInside_m = 0.32;  ///< the unseen inside of a wall is filled up to this thickness

/// Intersection of the mesh with the cutting plane, as lines on the image.
std::vector<std::pair<Vec2, Vec2>> cut_lines(const TriangleMesh& mesh, const RenderView& view,
                                             const ViewProjection& projection) {
  std::vector<std::pair<Vec2, Vec2>> lines;
  const auto height = [&](const Vec3& p) { return view.up.dot(p) - *view.cut_height_m; };
  const auto to_pixel = [&](const Vec3& p) -> Vec2 {
    return (projection.project(projection.to_camera(p)).head<2>() - Vec2::Constant(0.5)) / 2;
  };
  for (const auto& t : mesh.triangles) {
    if (std::max({t[0], t[1], t[2]}) >= mesh.vertices.size()) continue;
    std::vector<Vec3> crossing;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 a = mesh.vertices[t[k]].cast<double>(), b = mesh.vertices[t[(k + 1) % 3]].cast<double>();
      const double ha = height(a), hb = height(b);
      if ((ha >= 0) != (hb >= 0)) crossing.emplace_back(a + ha / (ha - hb) * (b - a));
    }
    if (crossing.size() != 2 || !crossing[0].allFinite() || !crossing[1].allFinite()) continue;
    lines.emplace_back(to_pixel(crossing[0]), to_pixel(crossing[1]));
  }
  return lines;
}

using Mask = Image<std::uint8_t>;

/// Calls visit(first, end, bounded) for the runs of pixels between walls along each row or column; visit also
/// gets a function that converts a position to a pixel.
template <class Visit>
void for_runs_between_walls(const Mask& walls, bool along_rows, Visit&& visit) {
  const int lines = along_rows ? walls.height() : walls.width();
  const int length = along_rows ? walls.width() : walls.height();
  for (int line = 0; line < lines; ++line) {
    const auto pixel = [&](int i) { return along_rows ? std::pair{i, line} : std::pair{line, i}; };
    const auto is_wall = [&](int i) { return walls(pixel(i).first, pixel(i).second) != 0; };
    int first = length;  // no run has begun: what lies before the first wall is outside
    for (int i = 0; i < length; ++i) {
      if (!is_wall(i)) continue;
      if (first < i) visit(first, i, pixel);
      first = i + 1;
    }
  }
}

/// Fills the interior of walls: empty runs of at most `longest` pixels between two cut surfaces.
void fill_unseen(Mask& walls, const VisibilityBuffer& buffer, int longest) {
  const Mask before = walls;
  for (const bool along_rows : {true, false})
    for_runs_between_walls(before, along_rows, [&](int first, int end, auto&& pixel) {
      if (end - first > longest) return;
      for (int i = first; i < end; ++i)
        if (buffer.hit(2 * pixel(i).first, 2 * pixel(i).second)) return;
      for (int i = first; i < end; ++i) walls(pixel(i).first, pixel(i).second) = 1;
    });
}

/// Fills the interior of cut solids: runs with mostly visible back faces, along the row and the column.
void fill_solids(Mask& walls, const Mask& seen_from_behind) {
  constexpr double kShare = 0.12;  // the bottom of a cupboard may fight with the floor that it stands on
  Mask votes(walls.width(), walls.height(), 0);
  for (const bool along_rows : {true, false})
    for_runs_between_walls(walls, along_rows, [&](int first, int end, auto&& pixel) {
      int behind = 0;
      for (int i = first; i < end; ++i) behind += seen_from_behind(pixel(i).first, pixel(i).second);
      if (behind < kShare * (end - first)) return;
      for (int i = first; i < end; ++i) ++votes(pixel(i).first, pixel(i).second);
    });
  for (std::size_t i = 0; i < walls.size(); ++i)
    if (votes.pixels()[i] == 2) walls.pixels()[i] = 1;
}

/// Share of each pixel that is wall (0..255): cut surfaces as lines, and what lies inside of them.
Image<Rgb8> wall_coverage(const TriangleMesh& mesh, const RenderView& view, const SurfaceFigure& figure) {
  const int width = figure.image.width(), height = figure.image.height();
  Image<Rgb8> lines(width, height, {0, 0, 0});
  const double line_px = std::max(1.6, kWallLine_m * view.pixels_per_m);
  for (const auto& [from, to] : cut_lines(mesh, view, figure.lit.projection))
    draw_line(lines, from, to, line_px, {{255, 255, 255}, 1});
  Mask walls(width, height, 0), behind(width, height, 0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      walls(x, y) = lines(x, y).r > 127 ? 1 : 0;
      if (walls(x, y) == 0 && figure.lit.buffer.hit(2 * x, 2 * y))
        behind(x, y) = surface_sample(mesh, figure.lit.buffer, figure.lit.projection, Vec2(2 * x, 2 * y))
                           .seen_from_behind;
    }
  fill_solids(walls, behind);
  const int longest = static_cast<int>(kWallInside_m * view.pixels_per_m) + 1;
  for (int pass = 0; pass < 2; ++pass)
    fill_unseen(walls, figure.lit.buffer, longest);  // then where walls meet
  for (std::size_t i = 0; i < walls.size(); ++i)
    if (walls.pixels()[i] != 0) lines.pixels()[i] = {255, 255, 255};
  return lines;
}

/// Light background with a faint grid of metres.
Image<Rgb8> page_with_grid(const RenderOptions& options, const RenderView& view, const SceneExtent& extent) {
  Image<Rgb8> page(options.width, options.height, {250, 250, 248});
  const ViewProjection projection(view, options.width, options.height, 1);
  const double step = view.pixels_per_m >= 12 ? 1 : 10;
  const Mat3 axes = extent.T_world_scene.rotation();
  const Vec3 centre = axes.transpose() * view.T_world_camera.translation();
  for (int axis = 0; axis < 2; ++axis) {
    const double half = 0.5 * (axis == 0 ? options.width : options.height) / view.pixels_per_m;
    if (!(half / step < 2000)) continue;  // too dense to be drawn
    for (double at = std::ceil((centre[axis] - half) / step) * step; at <= centre[axis] + half; at += step) {
      Vec3 p = centre;
      p[axis] = at;
      const Vec3 screen = projection.project(projection.to_camera(axes * p));
      const bool major = std::abs(std::remainder(at, 5 * step)) < 1e-6;
      const Ink ink{{118, 134, 156}, major ? 0.34 : 0.16};
      if (axis == 0)
        draw_line(page, {screen.x(), -1}, {screen.x(), options.height + 1.0}, 1, ink);
      else
        draw_line(page, {-1, screen.y()}, {options.width + 1.0, screen.y()}, 1, ink);
    }
  }
  return page;
}

void draw_scale_bar(Image<Rgb8>& image, double pixels_per_m) {
  double length_m = 1e-3;
  for (const double candidate : {0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0})
    if (candidate * pixels_per_m <= 0.2 * image.width()) length_m = candidate;
  const double length = length_m * pixels_per_m, text = text_size_px(image.width(), image.height());
  const Vec2 at(1.6 * text, image.height() - 1.6 * text);
  const std::string label =
      length_m >= 1 ? fmt::format("{:g} m", length_m) : fmt::format("{:g} cm", 100 * length_m);
  const double label_width = text_width_px(label, text);
  draw_panel(image,
             {at - Vec2(0.8 * text, 1.9 * text), at + Vec2(length + label_width + 1.6 * text, 0.8 * text)});
  const double thick = 0.42 * text;
  fill_rectangle(image, {at - Vec2(0, thick + 0.2 * text), at + Vec2(length, -0.2 * text)}, {kInkColor, 1});
  const double inset = 0.1 * text;
  for (int part = 1; part < 4; part += 2)
    fill_rectangle(image,
                   {at + Vec2(0.25 * part * length, -thick - 0.2 * text + inset),
                    at + Vec2(0.25 * (part + 1) * length - inset, -0.2 * text - inset)},
                   {{255, 255, 255}, 1});
  draw_text(image, at + Vec2(length + 0.7 * text, 0), label, {text, {kInkColor, 1}, TextAlign::kLeft});
}

}  // namespace

Image<Rgb8> render_floor_plan(const TriangleMesh& mesh, const SceneExtent& extent,
                              const RenderOptions& options, const ParallelLoop& loop) {
  HM_CHECK(options.width > 0 && options.height > 0, "{} x {}", options.width, options.height);
  const RenderView view = plan_view(extent, options);
  RenderView both = view;
  both.faces = Faces::kBoth;
  const LitSurface lit = light_surface(mesh, both, options, loop);
  SurfaceFigure figure = draw_surface(mesh, both, options, lit, loop, page_with_grid(options, view, extent));
  const Image<Rgb8> walls = wall_coverage(mesh, view, figure);
  for (int y = 0; y < options.height; ++y)
    for (int x = 0; x < options.width; ++x)
      if (walls(x, y).r > 0) blend_pixel(figure.image, x, y, {kWallColor, walls(x, y).r / 255.0});
  if (options.trajectory != nullptr) draw_trajectory(figure, view, *options.trajectory);
  draw_legend(figure, options);
  draw_scale_bar(figure.image, view.pixels_per_m);
  return std::move(figure.image);
}

}  // namespace hm
