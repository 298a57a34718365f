#pragma once
#include <string_view>

#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Colour with opacity (0 transparent .. 1 opaque).
struct Ink {
  Rgb8 color;
  double opacity = 1;
};

enum class TextAlign { kLeft, kCentre, kRight };

/// Anti-aliased drawing on an image, in pixels; (0, 0) is the centre of the top left one. Parts outside the
/// image are clipped; non-finite coordinates draw nothing.
void blend_pixel(Image<Rgb8>& image, int x, int y, const Ink& ink);
void fill_rectangle(Image<Rgb8>& image, const Eigen::AlignedBox2d& box, const Ink& ink);
void draw_line(Image<Rgb8>& image, const Vec2& from, const Vec2& to, double width_px, const Ink& ink);
void fill_circle(Image<Rgb8>& image, const Vec2& centre, double radius_px, const Ink& ink);

/// Style of one line of text in a simple stroke font (printable ASCII; others as a box). `size_px` is the
/// height of a capital letter; in draw_text(), `at` is the left end, centre or right end of the base line.
struct TextStyle {
  double size_px = 14;
  Ink ink;
  TextAlign align = TextAlign::kLeft;
};
void draw_text(Image<Rgb8>& image, const Vec2& at, std::string_view text, const TextStyle& style);
double text_width_px(std::string_view text, double size_px);

}  // namespace hm
