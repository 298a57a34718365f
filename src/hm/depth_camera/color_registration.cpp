#include "hm/depth_camera/color_registration.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

namespace hm {
namespace {

/// Inverse depths summed over squares of pixels, and how many readings they are of.
struct DepthSum {
  float inverse = 0;
  float count = 0;
};

/// Sums over squares of 2 x 2 pixels of an image of this size, whose pixels `at` gives.
template <class At>
Image<DepthSum> sums_of_squares(int width, int height, const At& at) {
  Image<DepthSum> sums((width + 1) / 2, (height + 1) / 2);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const DepthSum pixel = at(x, y);
      sums(x / 2, y / 2).inverse += pixel.inverse;
      sums(x / 2, y / 2).count += pixel.count;
    }
  return sums;
}

/// Each level has half the side of the one before, the first of the image; the last is a single pixel wide or
/// high.
std::vector<Image<DepthSum>> pyramid_of(const Image<float>& inverse) {
  const auto of_pixel = [&](int x, int y) {
    return DepthSum{inverse(x, y), inverse(x, y) > 0 ? 1.0F : 0.0F};
  };
  std::vector<Image<DepthSum>> levels;
  levels.push_back(sums_of_squares(inverse.width(), inverse.height(), of_pixel));
  while (std::min(levels.back().width(), levels.back().height()) > 1)
    levels.push_back(sums_of_squares(levels.back().width(), levels.back().height(), levels.back()));
  return levels;
}

/// Mean inverse depth of the smallest square around the pixel that has a reading; 0 (far away) if there is
/// none.
float inverse_depth_around(const std::vector<Image<DepthSum>>& levels, int x, int y) {
  for (std::size_t k = 0; k < levels.size(); ++k) {
    const DepthSum& sum = levels[k](x >> (k + 1), y >> (k + 1));
    if (sum.count > 0) return sum.inverse / sum.count;
  }
  return 0;
}

/// Inverse depths of all pixels, without holes unless there is no reading at all.
Image<float> filled_inverse_depths(const DepthImage& depth) {
  Image<float> inverse(depth.width(), depth.height());
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x)
      if (depth.units(x, y) > 0) inverse(x, y) = 1 / static_cast<float>(depth.depth_m(x, y));
  const std::vector<Image<DepthSum>> levels = pyramid_of(inverse);
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x)
      if (inverse(x, y) == 0) inverse(x, y) = inverse_depth_around(levels, x, y);
  return inverse;
}

/// Channels of an image between two of its rows.
void interpolate_row(const Image<Rgb8>& image, double at_y, std::span<double> channels) {
  const double y = std::clamp(at_y, 0.0, image.height() - 1.0);
  const int y0 = std::min(static_cast<int>(y), image.height() - 2);
  const double down = y - y0;
  const std::uint8_t *upper = &image(0, y0).r, *lower = &image(0, y0 + 1).r;
  for (std::size_t i = 0; i < channels.size(); ++i) channels[i] = upper[i] + down * (lower[i] - upper[i]);
}

/// Colour between the columns of such a row.
Rgb8 color_at(std::span<const double> channels, double at_x) {
  const auto columns = channels.size() / 3;
  const double x = std::clamp(at_x, 0.0, static_cast<double>(columns - 1));
  const std::size_t x0 = std::min(static_cast<std::size_t>(x), columns - 2);
  const double right = x - static_cast<double>(x0);
  const double* left = &channels[3 * x0];
  const auto mix = [&](int channel) {
    return static_cast<std::uint8_t>(left[channel] + right * (left[channel + 3] - left[channel]) + 0.5);
  };
  return {mix(0), mix(1), mix(2)};
}

}  // namespace

Image<Rgb8> register_color(const Image<Rgb8>& color, const DepthImage& depth,
                           const PinholeCamera& depth_camera, const ColorRegistration& registration) {
  if (color.width() < 2 || color.height() < 2) return color;
  const Image<float> inverse = filled_inverse_depths(depth);
  const Vec2 principal_point(depth_camera.cx, depth_camera.cy);
  std::vector<double> row(3 * static_cast<std::size_t>(color.width()));
  Image<Rgb8> result(depth.width(), depth.height());
  for (int y = 0; y < depth.height(); ++y) {
    // The cameras stand side by side: a row of one is a row of the other, whatever the depth.
    const Vec2 begin = registration.color_pixel(Vec2(0, y), principal_point, 0);
    interpolate_row(color, begin.y(), row);
    for (int x = 0; x < depth.width(); ++x) {
      const auto inverse_depth = static_cast<double>(inverse(x, y));
      result(x, y) = color_at(
          row, begin.x() + registration.scale_ratio * x + registration.parallax_px_m * inverse_depth);
    }
  }
  return result;
}

}  // namespace hm
