#include "hm/depth_camera/color_registration.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace hm {
namespace {

/// Inverse depths summed over squares of pixels, and how many readings they are of.
struct DepthSum {
  float inverse = 0;
  float count = 0;
};

/// Each level has half the side of the one before; the last is a single pixel wide or high.
std::vector<Image<DepthSum>> pyramid_of(const DepthImage& depth) {
  std::vector<Image<DepthSum>> levels(1, Image<DepthSum>(depth.width(), depth.height()));
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x)
      if (depth.units(x, y) > 0) levels[0](x, y) = {1 / static_cast<float>(depth.depth_m(x, y)), 1};
  while (std::min(levels.back().width(), levels.back().height()) > 1) {
    const Image<DepthSum>& fine = levels.back();
    Image<DepthSum> coarse((fine.width() + 1) / 2, (fine.height() + 1) / 2);
    for (int y = 0; y < fine.height(); ++y)
      for (int x = 0; x < fine.width(); ++x) {
        coarse(x / 2, y / 2).inverse += fine(x, y).inverse;
        coarse(x / 2, y / 2).count += fine(x, y).count;
      }
    levels.push_back(std::move(coarse));
  }
  return levels;
}

/// Inverse depth of the smallest square around the pixel that has a reading; 0 (far away) if there is none.
double inverse_depth_at(const std::vector<Image<DepthSum>>& levels, int x, int y) {
  for (std::size_t k = 0; k < levels.size(); ++k) {
    const DepthSum& sum = levels[k](x >> k, y >> k);
    if (sum.count > 0) return static_cast<double>(sum.inverse / sum.count);
  }
  return 0;
}

Rgb8 bilinear(const Image<Rgb8>& image, const Vec2& at) {
  const double x = std::clamp(at.x(), 0.0, image.width() - 1.0);
  const double y = std::clamp(at.y(), 0.0, image.height() - 1.0);
  const int x0 = std::min(static_cast<int>(x), image.width() - 2);
  const int y0 = std::min(static_cast<int>(y), image.height() - 2);
  const double right = x - x0, down = y - y0;
  const auto mix = [&](std::uint8_t Rgb8::*channel) {
    const double upper = (1 - right) * image(x0, y0).*channel + right * image(x0 + 1, y0).*channel;
    const double lower = (1 - right) * image(x0, y0 + 1).*channel + right * image(x0 + 1, y0 + 1).*channel;
    return static_cast<std::uint8_t>((1 - down) * upper + down * lower + 0.5);
  };
  return {mix(&Rgb8::r), mix(&Rgb8::g), mix(&Rgb8::b)};
}

}  // namespace

Image<Rgb8> register_color(const Image<Rgb8>& color, const DepthImage& depth,
                           const PinholeCamera& depth_camera, const ColorRegistration& registration) {
  if (color.width() < 2 || color.height() < 2) return color;
  const std::vector<Image<DepthSum>> levels = pyramid_of(depth);
  const Vec2 principal_point(depth_camera.cx, depth_camera.cy);
  Image<Rgb8> result(depth.width(), depth.height());
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x)
      result(x, y) = bilinear(
          color, registration.color_pixel(Vec2(x, y), principal_point, inverse_depth_at(levels, x, y)));
  return result;
}

}  // namespace hm
