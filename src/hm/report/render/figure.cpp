#include "hm/report/render/figure.hpp"

#include <algorithm>
#include <cmath>

#include "hm/core/statistics.hpp"
#include "hm/report/render/axis_ticks.hpp"
#include "hm/report/render/color_map.hpp"

namespace hm {
namespace {

/// Draws the colours of one surface.
class Painter {
 public:
  Painter(const TriangleMesh& mesh, const RenderView& view, const RenderOptions& options,
          const SurfaceFigure& figure)
      : mesh_(mesh), view_(view), options_(options), figure_(figure) {}

  /// Colour (components 0..1) of a sample with this ambient light.
  [[nodiscard]] Vec3 paint(int x, int y, double ambient) const {
    const SurfaceSample sample =
        surface_sample(mesh_, figure_.lit.buffer, figure_.lit.projection, Vec2(x, y));
    const Vec3 viewer = figure_.lit.projection.towards_viewer(sample.p_world);
    double light = brightness(sample, viewer, view_.up) * (0.35 + 0.65 * ambient);
    if (sample.seen_from_behind) light *= 0.6;
    // Colours that encode values are shaded only slightly.
    if (options_.style != RenderStyle::kShaded) light = 0.5 + 0.56 * light;
    return albedo(sample) * light;
  }

 private:
  [[nodiscard]] Vec3 albedo(const SurfaceSample& sample) const {
    const auto& t = mesh_.triangles[sample.triangle];
    switch (options_.style) {
      case RenderStyle::kHeight:
        return sequential_color(relative(view_.up.dot(sample.p_world)));
      case RenderStyle::kScalar:
        return scalar_color(sample, t);
      case RenderStyle::kColor:
        if (mesh_.has_colors()) return vertex_color(sample, t);
        break;
      case RenderStyle::kShaded:
        break;
    }
    return {0.97, 0.95, 0.92};
  }
  [[nodiscard]] double relative(double value) const {
    return (value - figure_.low) / std::max(1e-12, figure_.high - figure_.low);
  }
  [[nodiscard]] Vec3 scalar_color(const SurfaceSample& sample, const std::array<std::uint32_t, 3>& t) const {
    double value = 0;
    for (int k = 0; k < 3; ++k)
      value +=
          sample.weights[k] * static_cast<double>(options_.vertex_values[t[static_cast<std::size_t>(k)]]);
    return std::isfinite(value) ? diverging_color(2 * relative(value) - 1) : Vec3(0.6, 0.6, 0.6);
  }
  [[nodiscard]] Vec3 vertex_color(const SurfaceSample& sample, const std::array<std::uint32_t, 3>& t) const {
    Vec3 color = Vec3::Zero();
    for (int k = 0; k < 3; ++k) {
      const Rgb8& c = mesh_.colors[t[static_cast<std::size_t>(k)]];
      color += sample.weights[k] / 255.0 * Vec3(c.r, c.g, c.b);
    }
    return color;
  }

  const TriangleMesh& mesh_;
  const RenderView& view_;
  const RenderOptions& options_;
  const SurfaceFigure& figure_;
};

/// Chooses the ends of the colour map: percentiles of the heights in the image, or +- the values' 95th
/// percentile.
void choose_range(const RenderView& view, const RenderOptions& options, SurfaceFigure& figure) {
  std::vector<double> values;
  if (options.style == RenderStyle::kScalar) {
    double limit = options.value_limit;
    if (!(limit > 0)) {
      // Half a million of them are enough.
      const std::size_t step = 1 + options.vertex_values.size() / 500'000;
      for (std::size_t i = 0; i < options.vertex_values.size(); i += step)
        if (const float v = options.vertex_values[i]; std::isfinite(v))
          values.push_back(std::abs(static_cast<double>(v)));
      limit = std::max(1e-6, quantile(std::move(values), 0.95));
    }
    figure.low = -limit;
    figure.high = limit;
  } else if (options.style == RenderStyle::kHeight) {
    for (int y = 0; y < figure.lit.buffer.triangle.height(); y += 8)
      for (int x = 0; x < figure.lit.buffer.triangle.width(); x += 8)
        if (figure.lit.buffer.hit(x, y))
          values.push_back(view.up.dot(
              figure.lit.projection.unproject(x, y, static_cast<double>(figure.lit.buffer.nearness(x, y)))));
    figure.low = quantile(values, 0.01);
    figure.high = std::max(figure.low + 1e-3, quantile(values, 0.99));
  }
}

/// Averages the four samples of a pixel; samples of one triangle are painted once.
Vec3 resolve_pixel(const Painter& painter, const SurfaceFigure& figure, const Vec2& pixel, double ambient) {
  const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
  const Rgb8& under = figure.image(x, y);
  const Vec3 background = Vec3(under.r, under.g, under.b) / 255.0;
  Vec3 sum = Vec3::Zero(), last = Vec3::Zero();
  std::uint32_t last_triangle = kNoTriangle;
  for (int sample = 0; sample < 4; ++sample) {
    const int sx = 2 * x + (sample & 1), sy = 2 * y + (sample >> 1);
    const std::uint32_t triangle = figure.lit.buffer.triangle(sx, sy);
    if (triangle == kNoTriangle) {
      sum += background;
      continue;
    }
    if (triangle != last_triangle) last = painter.paint(sx, sy, ambient);
    last_triangle = triangle;
    sum += last.cwiseMin(1.0);
  }
  return sum / 4;
}

std::vector<Vec2> screen_path(const SurfaceFigure& figure, const Trajectory& trajectory,
                              std::vector<double>& nearness) {
  std::vector<Vec2> path;
  for (const StampedPose& pose : trajectory) {
    const Vec3 p_camera = figure.lit.projection.to_camera(pose.T_world_base.translation());
    if (!(p_camera.z() > figure.lit.projection.near_m())) continue;
    const Vec3 screen = figure.lit.projection.project(p_camera);
    const Vec2 pixel = (screen.head<2>() - Vec2::Constant(0.5)) / 2;
    if (!path.empty() && (pixel - path.back()).norm() < 1.5) continue;
    path.push_back(pixel);
    nearness.push_back(screen.z());
  }
  return path;
}

/// Formats a number with the digits needed for the distance between ticks.
std::string tick_text(double value, double step) {
  const int digits = step >= 1 ? 0 : step >= 0.1 ? 1 : step >= 0.01 ? 2 : 3;
  if (std::abs(value) < 1e-9) value = 0;
  return fmt::format("{:.{}f}", value, digits);
}

}  // namespace

LitSurface light_surface(const TriangleMesh& mesh, const RenderView& view, const RenderOptions& size,
                         const ParallelLoop& loop) {
  RenderOptions samples = size;
  samples.width = 2 * size.width;
  samples.height = 2 * size.height;
  const ViewProjection projection(view, size.width, size.height, 2);
  LitSurface lit{rasterise(mesh, view, projection, samples, loop), projection, {}};
  lit.light = ambient_light(mesh, lit.buffer, projection, loop);
  return lit;
}

SurfaceFigure draw_surface(const TriangleMesh& mesh, const RenderView& view, const RenderOptions& options,
                           const LitSurface& lit, const ParallelLoop& loop, Image<Rgb8> background) {
  SurfaceFigure figure{std::move(background), lit};
  choose_range(view, options, figure);
  const Painter painter(mesh, view, options, figure);
  loop.for_ranges(static_cast<std::size_t>(options.height), 8, [&](std::size_t begin, std::size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
      for (int x = 0; x < options.width; ++x)
        figure.image(x, y) =
            to_rgb8(resolve_pixel(painter, figure, Vec2(x, y), static_cast<double>(lit.light(x, y))));
  });
  return figure;
}

void draw_trajectory(SurfaceFigure& figure, const RenderView& view, const Trajectory& trajectory) {
  std::vector<double> nearness;
  const std::vector<Vec2> path = screen_path(figure, trajectory, nearness);
  if (path.empty()) return;
  const double width = 0.0016 * figure.image.width() + 0.6;
  const bool from_above = view.projection == Projection::kOrthographic;
  const Rgb8 line{230, 92, 32};
  for (std::size_t i = 1; i < path.size(); ++i) {
    const bool is_near = (path[i] - path[i - 1]).norm() <= 0.25 * figure.image.width();  // false for NaN, too
    if (!is_near) continue;  // a jump, or around the edge
    const int x = 2 * static_cast<int>(std::clamp(path[i].x(), -1e6, 1e6));
    const int y = 2 * static_cast<int>(std::clamp(path[i].y(), -1e6, 1e6));
    const bool hidden = !from_above && figure.lit.buffer.triangle.contains(x, y) &&
                        nearness[i] < static_cast<double>(figure.lit.buffer.nearness(x, y));
    draw_line(figure.image, path[i - 1], path[i], width, {line, hidden ? 0.25 : 1.0});
  }
  const double dot = 2.2 * width;
  fill_circle(figure.image, path.front(), dot + 1.5, {{255, 255, 255}, 1});
  fill_circle(figure.image, path.front(), dot, {{28, 140, 84}, 1});
  fill_circle(figure.image, path.back(), dot + 1.5, {{255, 255, 255}, 1});
  fill_circle(figure.image, path.back(), dot, {{200, 40, 50}, 1});
}

void draw_panel(Image<Rgb8>& image, const Eigen::AlignedBox2d& box) {
  fill_rectangle(image, box, {{255, 255, 255}, 0.82});
}

void draw_legend(SurfaceFigure& figure, const RenderOptions& options) {
  const bool scalar = options.style == RenderStyle::kScalar;
  if (!scalar && options.style != RenderStyle::kHeight) return;
  const double factor = scalar ? 1e3 : 1.0;
  const std::string label = scalar ? options.value_label : "height (m)";
  Image<Rgb8>& image = figure.image;
  const double text = text_size_px(image.width(), image.height());
  const double bar_height = 0.42 * image.height(), bar_width = 1.5 * text;
  const double panel_width = std::max(text_width_px(label, text), bar_width + 5.5 * text) + 2.4 * text;
  const Vec2 corner(image.width() - panel_width - text, text);
  draw_panel(image, {corner, corner + Vec2(panel_width, bar_height + 5.2 * text)});
  draw_text(image, corner + Vec2(1.2 * text, 2.2 * text), label, {text, {kInkColor, 1}, TextAlign::kLeft});
  const Vec2 top = corner + Vec2(1.2 * text, 3.8 * text);
  for (int y = 0; y <= static_cast<int>(bar_height); ++y) {
    const double value = 1 - y / bar_height;
    const Rgb8 color = to_rgb8(scalar ? diverging_color(2 * value - 1) : sequential_color(value));
    fill_rectangle(image, {top + Vec2(0, y - 0.5), top + Vec2(bar_width, y + 1.5)}, {color, 1});
  }
  const std::vector<double> ticks = nice_ticks(figure.low * factor, figure.high * factor, 6);
  const double step = ticks.size() > 1 ? ticks[1] - ticks[0] : 1;
  for (const double tick : ticks) {
    const double y = bar_height * (1 - (tick / factor - figure.low) / (figure.high - figure.low));
    const Vec2 at = top + Vec2(bar_width, y);
    draw_line(image, at, at + Vec2(0.5 * text, 0), std::max(1.0, 0.1 * text), {kInkColor, 1});
    const std::string sign = scalar && tick > 1e-9 ? "+" : "";
    draw_text(image, at + Vec2(text, 0.5 * text), sign + tick_text(tick, step),
              {text, {kInkColor, 1}, TextAlign::kLeft});
  }
}

}  // namespace hm
