#pragma once
#include "hm/geometry/camera.hpp"
#include "hm/geometry/image.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Where the colour camera looks, relative to the depth camera, in images that are not registered. A point
/// that depth sees at pixel p and distance z lies in the colour image, whose axes are parallel, at
///
///     c + shift_px + scale_ratio (p - c) + (parallax_px_m / z, 0)
///
/// with the depth camera's principal point c: a camera of scale_ratio times its focal length f, which stands
/// parallax_px_m / (scale_ratio f) to its left.
struct ColorRegistration {
  double scale_ratio = 1;
  Vec2 shift_px = Vec2::Zero();
  double parallax_px_m = 0;

  [[nodiscard]] Vec2 color_pixel(const Vec2& pixel, const Vec2& principal_point, double inverse_depth) const {
    // By components: a vector that has just been written as two numbers is slow to read as one.
    const Vec2 c = principal_point + shift_px;
    return {c.x() + scale_ratio * (pixel.x() - principal_point.x()) + parallax_px_m * inverse_depth,
            c.y() + scale_ratio * (pixel.y() - principal_point.y())};
  }
};

/// The colour image as the depth camera would see it, bilinear, of the depth image's size. Where there is no
/// depth, that around it is taken. What neither camera hides from the other is right; a colour that only one
/// of them sees is that of the nearer surface beside it.
Image<Rgb8> register_color(const Image<Rgb8>& color, const DepthImage& depth,
                           const PinholeCamera& depth_camera, const ColorRegistration& registration);

}  // namespace hm
