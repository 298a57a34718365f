#include "hm/report/render/canvas.hpp"

#include <algorithm>
#include <cmath>

#include "hm/report/render/stroke_font.hpp"

namespace hm {
namespace {

std::uint8_t mix(std::uint8_t under, std::uint8_t over, double opacity) {
  return static_cast<std::uint8_t>(std::lround(under + opacity * (over - under)));
}

struct PixelRange {
  int x0, y0, x1, y1;  // half open
};

PixelRange pixels_within(const Image<Rgb8>& image, const Eigen::AlignedBox2d& box) {
  const auto clamp_to = [](double value, int size) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(size)));
  };
  if (!box.min().allFinite() || !box.max().allFinite()) return {0, 0, 0, 0};
  return {clamp_to(std::floor(box.min().x()), image.width()),
          clamp_to(std::floor(box.min().y()), image.height()),
          clamp_to(std::ceil(box.max().x()) + 1, image.width()),
          clamp_to(std::ceil(box.max().y()) + 1, image.height())};
}

/// Calls coverage(pixel centre) for the pixels of a box and blends by it.
template <class Coverage>
void fill_by_coverage(Image<Rgb8>& image, const Eigen::AlignedBox2d& box, const Ink& ink,
                      Coverage&& coverage) {
  const PixelRange range = pixels_within(image, box);
  for (int y = range.y0; y < range.y1; ++y)
    for (int x = range.x0; x < range.x1; ++x) {
      const double covered = std::clamp(coverage(Vec2(x, y)), 0.0, 1.0);
      if (covered > 0) blend_pixel(image, x, y, {ink.color, ink.opacity * covered});
    }
}

/// Draws a polyline without blending its joints twice: the coverage is the maximum over its segments.
void draw_polyline(Image<Rgb8>& image, std::span<const Vec2> points, double width_px, const Ink& ink) {
  Eigen::AlignedBox2d box;
  for (const Vec2& p : points) box.extend(p);
  const Vec2 margin = Vec2::Constant(width_px + 1);
  fill_by_coverage(image, {box.min() - margin, box.max() + margin}, ink, [&](const Vec2& pixel) {
    double distance = (pixel - points[0]).norm();
    for (std::size_t i = 1; i < points.size(); ++i) {
      const Vec2 along = points[i] - points[i - 1];
      const double t =
          along.squaredNorm() > 0 ? (pixel - points[i - 1]).dot(along) / along.squaredNorm() : 0.0;
      distance = std::min(distance, (pixel - points[i - 1] - std::clamp(t, 0.0, 1.0) * along).norm());
    }
    return 0.5 * width_px + 0.5 - distance;
  });
}

}  // namespace

void blend_pixel(Image<Rgb8>& image, int x, int y, const Ink& ink) {
  if (!image.contains(x, y)) return;
  Rgb8& pixel = image(x, y);
  pixel = {mix(pixel.r, ink.color.r, ink.opacity), mix(pixel.g, ink.color.g, ink.opacity),
           mix(pixel.b, ink.color.b, ink.opacity)};
}

void fill_rectangle(Image<Rgb8>& image, const Eigen::AlignedBox2d& box, const Ink& ink) {
  fill_by_coverage(image, box, ink, [&](const Vec2& pixel) {
    const Vec2 overlap = (box.max() - pixel).cwiseMin(pixel - box.min()) + Vec2::Constant(0.5);
    return std::clamp(overlap.x(), 0.0, 1.0) * std::clamp(overlap.y(), 0.0, 1.0);
  });
}

void draw_line(Image<Rgb8>& image, const Vec2& from, const Vec2& to, double width_px, const Ink& ink) {
  if (!from.allFinite() || !to.allFinite()) return;
  // In short pieces, so that a long slanted line does not visit its whole bounding box.
  const int pieces = std::clamp(static_cast<int>((to - from).norm() / 48), 1, 4096);
  if (pieces == 1) {
    const Vec2 points[] = {from, to};
    draw_polyline(image, points, width_px, ink);
    return;
  }
  const Vec2 direction = (to - from).normalized();
  for (int i = 0; i < pieces; ++i) {
    const Vec2 a = from + (to - from) * i / pieces, b = from + (to - from) * (i + 1) / pieces;
    const Vec2 margin = Vec2::Constant(width_px + 1);
    const double length = (b - a).norm();
    Eigen::AlignedBox2d box(a.cwiseMin(b) - margin, a.cwiseMax(b) + margin);
    fill_by_coverage(image, box, ink, [&](const Vec2& pixel) {
      const double along = (pixel - a).dot(direction);
      if (along < 0 || along >= length) return 0.0;
      const double across = std::abs((pixel - a).x() * direction.y() - (pixel - a).y() * direction.x());
      return 0.5 * width_px + 0.5 - across;
    });
  }
}

void fill_circle(Image<Rgb8>& image, const Vec2& centre, double radius_px, const Ink& ink) {
  if (!centre.allFinite()) return;
  const Vec2 margin = Vec2::Constant(radius_px + 1);
  fill_by_coverage(image, {centre - margin, centre + margin}, ink,
                   [&](const Vec2& pixel) { return radius_px + 0.5 - (pixel - centre).norm(); });
}

double text_width_px(std::string_view text, double size_px) {
  double units = 0;
  for (const char c : text) units += stroke_glyph(c).advance;
  return text.empty() ? 0.0 : (units - kGlyphGap) * size_px / kGlyphHeight;
}

void draw_text(Image<Rgb8>& image, const Vec2& at, std::string_view text, const TextStyle& style) {
  const double unit = style.size_px / kGlyphHeight;
  const double width = text_width_px(text, style.size_px);
  double pen = at.x() - (style.align == TextAlign::kLeft     ? 0
                         : style.align == TextAlign::kCentre ? width / 2
                                                             : width);
  const double line_width = std::max(1.0, 0.115 * style.size_px);
  for (const char c : text) {
    const StrokeGlyph glyph = stroke_glyph(c);
    for (const std::vector<Vec2>& stroke : glyph.strokes) {
      std::vector<Vec2> points;
      for (const Vec2& p : stroke)
        points.emplace_back(pen + unit * p.x(), at.y() + unit * (p.y() - kGlyphHeight));
      draw_polyline(image, points, line_width, style.ink);
    }
    pen += unit * glyph.advance;
  }
}

}  // namespace hm
