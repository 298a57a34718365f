#include "hm/report/render/mesh_renderer.hpp"

#include "hm/core/check.hpp"
#include "hm/report/render/color_map.hpp"
#include "hm/report/render/figure.hpp"

namespace hm {
namespace {

/// Light, a little darker towards the bottom.
Image<Rgb8> gradient_background(const RenderOptions& options) {
  Image<Rgb8> image(options.width, options.height);
  for (int y = 0; y < options.height; ++y) {
    const double down = static_cast<double>(y) / std::max(1, options.height - 1);
    const Rgb8 color = to_rgb8(Vec3(0.975, 0.98, 0.988) - down * Vec3(0.085, 0.07, 0.05));
    for (Rgb8& pixel : image.row(y)) pixel = color;
  }
  return image;
}

}  // namespace

std::vector<Image<Rgb8>> render_styles(const TriangleMesh& mesh, const RenderView& view,
                                       std::span<const RenderOptions> styles, const ParallelLoop& loop) {
  std::vector<Image<Rgb8>> images;
  if (styles.empty()) return images;
  const RenderOptions& size = styles.front();
  HM_CHECK(size.width > 0 && size.height > 0, "{} x {}", size.width, size.height);
  const LitSurface lit = light_surface(mesh, view, size, loop);
  for (const RenderOptions& options : styles) {
    HM_CHECK(options.width == size.width && options.height == size.height, "{} x {}", options.width,
             options.height);
    HM_CHECK(options.style != RenderStyle::kScalar || options.vertex_values.size() == mesh.vertices.size(),
             "{} values for {} vertices", options.vertex_values.size(), mesh.vertices.size());
    SurfaceFigure figure = draw_surface(mesh, view, options, lit, loop, gradient_background(options));
    if (options.trajectory != nullptr) draw_trajectory(figure, view, *options.trajectory);
    draw_legend(figure, options);
    images.push_back(std::move(figure.image));
  }
  return images;
}

Image<Rgb8> render_mesh(const TriangleMesh& mesh, const RenderView& view, const RenderOptions& options,
                        const ParallelLoop& loop) {
  return std::move(render_styles(mesh, view, {&options, 1}, loop).front());
}

}  // namespace hm
