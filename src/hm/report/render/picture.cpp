#include "hm/report/render/picture.hpp"

#include <algorithm>
#include <cmath>

#include "hm/core/statistics.hpp"
#include "hm/report/render/color_map.hpp"

namespace hm {
namespace {

/// Draws the colours of one surface.
class Painter {
 public:
  Painter(const TriangleMesh& mesh, const RenderView& view, const RenderOptions& options,
          const SurfacePicture& picture)
      : mesh_(mesh), view_(view), options_(options), picture_(picture) {}

  /// Colour (components 0..1) of a sample in a place where this share of the surrounding light arrives.
  [[nodiscard]] Vec3 paint(int x, int y, double ambient) const {
    const SurfaceSample sample = surface_sample(mesh_, picture_.buffer, picture_.projection, Vec2(x, y));
    const Vec3 viewer = picture_.projection.towards_viewer(sample.p_world);
    double light = brightness(sample, viewer, view_.up) * (0.35 + 0.65 * ambient);
    if (sample.seen_from_behind) light *= 0.6;
    // Colours that carry meaning are lit only a little.
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
    return (value - picture_.low) / std::max(1e-12, picture_.high - picture_.low);
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
  const SurfacePicture& picture_;
};

/// The ends of the colour map: percentiles of the heights in the picture, or +- the values' 95th percentile.
void choose_range(const RenderView& view, const RenderOptions& options, SurfacePicture& picture) {
  std::vector<double> values;
  if (options.style == RenderStyle::kScalar) {
    double limit = options.value_limit;
    if (!(limit > 0)) {
      // Half a million of them say it well enough.
      const std::size_t step = 1 + options.vertex_values.size() / 500'000;
      for (std::size_t i = 0; i < options.vertex_values.size(); i += step)
        if (const float v = options.vertex_values[i]; std::isfinite(v))
          values.push_back(std::abs(static_cast<double>(v)));
      limit = std::max(1e-6, quantile(std::move(values), 0.95));
    }
    picture.low = -limit;
    picture.high = limit;
  } else if (options.style == RenderStyle::kHeight) {
    for (int y = 0; y < picture.buffer.triangle.height(); y += 8)
      for (int x = 0; x < picture.buffer.triangle.width(); x += 8)
        if (picture.buffer.hit(x, y))
          values.push_back(view.up.dot(
              picture.projection.unproject(x, y, static_cast<double>(picture.buffer.nearness(x, y)))));
    picture.low = quantile(values, 0.01);
    picture.high = std::max(picture.low + 1e-3, quantile(values, 0.99));
  }
}

/// Averages the four samples of a pixel; samples of one triangle are painted once.
Vec3 resolve_pixel(const Painter& painter, const SurfacePicture& picture, const Vec2& pixel, double ambient) {
  const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
  const Rgb8& under = picture.image(x, y);
  const Vec3 background = Vec3(under.r, under.g, under.b) / 255.0;
  Vec3 sum = Vec3::Zero(), last = Vec3::Zero();
  std::uint32_t last_triangle = kNoTriangle;
  for (int sample = 0; sample < 4; ++sample) {
    const int sx = 2 * x + (sample & 1), sy = 2 * y + (sample >> 1);
    const std::uint32_t triangle = picture.buffer.triangle(sx, sy);
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

std::vector<Vec2> screen_path(const SurfacePicture& picture, const Trajectory& trajectory,
                              std::vector<double>& nearness) {
  std::vector<Vec2> path;
  for (const StampedPose& pose : trajectory) {
    const Vec3 p_camera = picture.projection.to_camera(pose.T_world_base.translation());
    if (!(p_camera.z() > picture.projection.near_m())) continue;
    const Vec3 screen = picture.projection.project(p_camera);
    const Vec2 pixel = (screen.head<2>() - Vec2::Constant(0.5)) / 2;
    if (!path.empty() && (pixel - path.back()).norm() < 1.5) continue;
    path.push_back(pixel);
    nearness.push_back(screen.z());
  }
  return path;
}

}  // namespace

SurfacePicture draw_surface(const TriangleMesh& mesh, const RenderView& view, const RenderOptions& options,
                            const ParallelLoop& loop, Image<Rgb8> background) {
  RenderOptions samples = options;
  samples.width = 2 * options.width;
  samples.height = 2 * options.height;
  const ViewProjection projection(view, options.width, options.height, 2);
  SurfacePicture picture{std::move(background), rasterise(mesh, view, projection, samples, loop), projection};
  choose_range(view, options, picture);
  const Image<float> ambient = ambient_light(mesh, picture.buffer, projection, loop);
  const Painter painter(mesh, view, options, picture);
  loop.for_ranges(static_cast<std::size_t>(options.height), 8, [&](std::size_t begin, std::size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
      for (int x = 0; x < options.width; ++x)
        picture.image(x, y) =
            to_rgb8(resolve_pixel(painter, picture, Vec2(x, y), static_cast<double>(ambient(x, y))));
  });
  return picture;
}

void draw_trajectory(SurfacePicture& picture, const RenderView& view, const Trajectory& trajectory) {
  std::vector<double> nearness;
  const std::vector<Vec2> path = screen_path(picture, trajectory, nearness);
  if (path.empty()) return;
  const double width = 0.0016 * picture.image.width() + 0.6;
  const bool from_above = view.projection == Projection::kOrthographic;
  const Rgb8 line{230, 92, 32};
  for (std::size_t i = 1; i < path.size(); ++i) {
    if ((path[i] - path[i - 1]).norm() > 0.25 * picture.image.width())
      continue;  // a jump, or around the edge
    const int x = 2 * static_cast<int>(std::clamp(path[i].x(), -1e6, 1e6));
    const int y = 2 * static_cast<int>(std::clamp(path[i].y(), -1e6, 1e6));
    const bool hidden = !from_above && picture.buffer.triangle.contains(x, y) &&
                        nearness[i] < static_cast<double>(picture.buffer.nearness(x, y));
    draw_line(picture.image, path[i - 1], path[i], width, {line, hidden ? 0.25 : 1.0});
  }
  const double dot = 2.2 * width;
  fill_circle(picture.image, path.front(), dot + 1.5, {{255, 255, 255}, 1});
  fill_circle(picture.image, path.front(), dot, {{28, 140, 84}, 1});
  fill_circle(picture.image, path.back(), dot + 1.5, {{255, 255, 255}, 1});
  fill_circle(picture.image, path.back(), dot, {{200, 40, 50}, 1});
}

}  // namespace hm
