#pragma once
#include <string_view>

#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// A colour with coverage (0 transparent .. 1 opaque).
struct Ink {
  Rgb8 color;
  double opacity = 1;
};

enum class TextAlign { kLeft, kCentre, kRight };

/// Anti-aliased drawing on an image, pixels, (0, 0) the centre of the top left one. Whatever lies
/// outside of the image is left out; coordinates that are not finite draw nothing.
void blend_pixel(Image<Rgb8>& image, int x, int y, const Ink& ink);
void fill_rectangle(Image<Rgb8>& image, const Eigen::AlignedBox2d& box, const Ink& ink);
void draw_line(Image<Rgb8>& image, const Vec2& from, const Vec2& to, double width_px, const Ink& ink);
void fill_circle(Image<Rgb8>& image, const Vec2& centre, double radius_px, const Ink& ink);

/// Text of one line in a plain stroke font of our own (printable ASCII; others as a box). `size_px` is the
/// height of a capital, `at` the left, middle or right end of the base line.
struct TextStyle {
  double size_px = 14;
  Ink ink;
  TextAlign align = TextAlign::kLeft;
};
void draw_text(Image<Rgb8>& image, const Vec2& at, std::string_view text, const TextStyle& style);
double text_width_px(std::string_view text, double size_px);

}  // namespace hm
