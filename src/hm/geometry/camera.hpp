#pragma once
#include "hm/core/result.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Brown-Conrady lens distortion (Brown 1971), the k1 k2 p1 p2 k3 of OpenCV; all zero for none.
struct LensDistortion {
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  [[nodiscard]] bool is_zero() const { return k1 == 0 && k2 == 0 && p1 == 0 && p2 == 0 && k3 == 0; }
};

/// A pinhole camera looking along +z (x right, y down). Pixels; pixel centres at whole coordinates. A
/// negative fy is allowed: it mirrors the image vertically (ICL-NUIM).
struct PinholeCamera {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  LensDistortion distortion;

  /// The pixel that sees a point in front of the camera (z > 0), distortion included; it may lie outside
  /// of the image.
  [[nodiscard]] Vec2 project(const Vec3& p_camera) const;
  /// The point at this depth (z, metres) seen by a pixel. Exact without distortion; with it, the
  /// distortion is inverted by fixed-point iteration (to about 1e-9 for ordinary lenses).
  [[nodiscard]] Vec3 unproject(const Vec2& pixel, double depth_m) const;
  /// True when the pixel's cell (half a pixel beyond the outer centres) belongs to the image.
  [[nodiscard]] bool contains(const Vec2& pixel) const {
    return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() < width - 0.5 && pixel.y() < height - 0.5;
  }
  [[nodiscard]] PinholeCamera without_distortion() const;
  /// The camera of an image resampled by `ratio` (0.5: half as wide), pixel centres kept consistent.
  [[nodiscard]] PinholeCamera scaled(double ratio) const;
};

/// An error naming the value when sizes, focal lengths, principal point or distortion cannot be those of a
/// camera: not finite, or far from any lens. The one check of every reader.
Result<void> check_camera(const PinholeCamera& camera);

}  // namespace hm
