#pragma once
#include "hm/report/render/canvas.hpp"
#include "hm/report/render/shading.hpp"

namespace hm {

/// Visible surface of a mesh and the light on it: common to views of every style. Internal to this room.
struct LitSurface {
  VisibilityBuffer buffer;  ///< two samples along each side of a pixel
  ViewProjection projection;
  Image<float> light;  ///< of a pixel, see ambient_light
};
/// `size`: its width and height are used.
LitSurface light_surface(const TriangleMesh& mesh, const RenderView& view, const RenderOptions& size,
                         const ParallelLoop& loop);

/// Surface drawn without labels, with the data for drawing on top of it.
struct SurfaceFigure {
  Image<Rgb8> image;
  const LitSurface& lit;
  double low = 0, high = 1;  ///< values at the ends of the colour map, metres
};
SurfaceFigure draw_surface(const TriangleMesh& mesh, const RenderView& view, const RenderOptions& options,
                           const LitSurface& lit, const ParallelLoop& loop, Image<Rgb8> background);

/// Draws the camera's path; parts hidden by the surface are faint.
void draw_trajectory(SurfaceFigure& figure, const RenderView& view, const Trajectory& trajectory);
/// Draws the colour map with its values, for styles that have one.
void draw_legend(SurfaceFigure& figure, const RenderOptions& options);
/// Draws a panel that makes labels readable on any image.
void draw_panel(Image<Rgb8>& image, const Eigen::AlignedBox2d& box);

inline constexpr Rgb8 kInkColor{45, 50, 60};
/// Text size suitable for an image size.
inline double text_size_px(int width, int height) {
  return std::max(7.0, 0.011 * (width + height) / 2 * 1.0);
}

}  // namespace hm
