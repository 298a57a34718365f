#include <cmath>

#include "hm/report/render/axis_ticks.hpp"
#include "hm/report/render/color_map.hpp"
#include "hm/report/render/picture.hpp"

namespace hm {
namespace {

/// A number with as many digits as the distance between ticks needs.
std::string tick_text(double value, double step) {
  const int digits = step >= 1 ? 0 : step >= 0.1 ? 1 : step >= 0.01 ? 2 : 3;
  if (std::abs(value) < 1e-9) value = 0;
  return fmt::format("{:.{}f}", value, digits);
}

}  // namespace

void draw_panel(Image<Rgb8>& image, const Eigen::AlignedBox2d& box) {
  fill_rectangle(image, box, {{255, 255, 255}, 0.82});
}

void draw_legend(SurfacePicture& picture, const RenderOptions& options) {
  const bool scalar = options.style == RenderStyle::kScalar;
  if (!scalar && options.style != RenderStyle::kHeight) return;
  const double factor = scalar ? 1e3 : 1.0;
  const std::string label = scalar ? options.value_label : "height (m)";
  Image<Rgb8>& image = picture.image;
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
  const std::vector<double> ticks = nice_ticks(picture.low * factor, picture.high * factor, 6);
  const double step = ticks.size() > 1 ? ticks[1] - ticks[0] : 1;
  for (const double tick : ticks) {
    const double y = bar_height * (1 - (tick / factor - picture.low) / (picture.high - picture.low));
    const Vec2 at = top + Vec2(bar_width, y);
    draw_line(image, at, at + Vec2(0.5 * text, 0), std::max(1.0, 0.1 * text), {kInkColor, 1});
    const std::string sign = scalar && tick > 1e-9 ? "+" : "";
    draw_text(image, at + Vec2(text, 0.5 * text), sign + tick_text(tick, step),
              {text, {kInkColor, 1}, TextAlign::kLeft});
  }
}

}  // namespace hm
