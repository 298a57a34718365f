#include "hm/io/depth_registration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hm {
namespace {

/// Two readings on both sides of a hole belong to one surface when they differ by less than this share.
constexpr double kSameSurfaceRatio = 0.03;

/// What fills a hole between two readings, or 0.
std::uint16_t between(std::uint16_t a, std::uint16_t b) {
  if (a == 0 || b == 0) return 0;
  const int sum = a + b, difference = a > b ? a - b : b - a;
  if (difference > kSameSurfaceRatio * sum / 2) return 0;
  return static_cast<std::uint16_t>((sum + 1) / 2);
}

/// Holes one pixel wide or high. Only readings of `depth` itself fill them, so that filling does not spread.
Image<std::uint16_t> fill_small_holes(const Image<std::uint16_t>& depth) {
  Image<std::uint16_t> filled = depth;
  const int width = depth.width(), height = depth.height();
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (depth(x, y) != 0) continue;
      std::uint16_t value =
          x > 0 && x + 1 < width ? between(depth(x - 1, y), depth(x + 1, y)) : std::uint16_t{0};
      if (value == 0 && y > 0 && y + 1 < height) value = between(depth(x, y - 1), depth(x, y + 1));
      filled(x, y) = value;
    }
  }
  return filled;
}

}  // namespace

DepthRegistration::DepthRegistration(const PinholeCamera& depth_camera, const PinholeCamera& color_camera,
                                     const SE3& T_color_depth)
    : depth_camera_(depth_camera), color_camera_(color_camera), T_color_depth_(T_color_depth) {
  HM_CHECK(depth_camera.distortion.is_zero() && color_camera.distortion.is_zero(), "rectify first");
}

Image<std::uint16_t> DepthRegistration::apply(const Image<std::uint16_t>& depth, double unit_m) const {
  HM_CHECK(depth.width() == depth_camera_.width && depth.height() == depth_camera_.height, "{} x {}",
           depth.width(), depth.height());
  const PinholeCamera& to = color_camera_;
  Image<std::uint16_t> registered(to.width, to.height);
  // Everything in units of the image; a ray's point is depth * direction + origin.
  const Vec3 origin = T_color_depth_.translation() / unit_m;
  const Vec3 step = T_color_depth_.rotation() * Vec3(1 / depth_camera_.fx, 0, 0);
  for (int y = 0; y < depth.height(); ++y) {
    const Vec3 first = T_color_depth_.rotation() * depth_camera_.unproject(Vec2(0, y), 1.0);
    for (int x = 0; x < depth.width(); ++x) {
      const std::uint16_t reading = depth(x, y);
      if (reading == 0) continue;
      const Vec3 p = static_cast<double>(reading) * (first + static_cast<double>(x) * step) + origin;
      if (p.z() < 0.5 || p.z() >= 65534.5) continue;
      const double scale = 1 / p.z();
      const double u = to.fx * p.x() * scale + to.cx + 0.5, v = to.fy * p.y() * scale + to.cy + 0.5;
      if (!(u >= 0 && v >= 0 && u < to.width && v < to.height)) continue;
      std::uint16_t& place = registered(static_cast<int>(u), static_cast<int>(v));
      const auto z = static_cast<std::uint16_t>(p.z() + 0.5);
      if (place == 0 || z < place) place = z;
    }
  }
  return fill_small_holes(registered);
}

}  // namespace hm
