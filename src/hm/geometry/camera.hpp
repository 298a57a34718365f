#pragma once
#include "hm/core/result.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Brown-Conrady lens distortion (Brown 1971), coefficients k1 k2 p1 p2 k3 as in OpenCV; all zero: none.
struct LensDistortion {
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  [[nodiscard]] bool is_zero() const { return k1 == 0 && k2 == 0 && p1 == 0 && p2 == 0 && k3 == 0; }
};

/// Pinhole camera looking along +z (x right, y down). Parameters in pixels; pixel centres at integer
/// coordinates. A negative fy is allowed and mirrors the image vertically (ICL-NUIM).
struct PinholeCamera {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  LensDistortion distortion;

  /// Projects a point in front of the camera (z > 0, metres) to a pixel, with distortion; it may lie outside
  /// the image.
  [[nodiscard]] Vec2 project(const Vec3& p_camera) const;
  /// Point in the camera frame at this pixel and depth (z, metres). Exact without distortion, which is
  /// otherwise inverted by fixed-point iteration (to about 1e-9 for ordinary lenses).
  [[nodiscard]] Vec3 unproject(const Vec2& pixel, double depth_m) const;
  /// True when the pixel's cell (half a pixel beyond the outer centres) belongs to the image.
  [[nodiscard]] bool contains(const Vec2& pixel) const {
    return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() < width - 0.5 && pixel.y() < height - 0.5;
  }
  [[nodiscard]] PinholeCamera without_distortion() const;
  /// Camera of an image resampled by `ratio` (0.5: half as wide), pixel centres kept consistent.
  [[nodiscard]] PinholeCamera scaled(double ratio) const;
};

/// Checks the parameters; the error names the value when sizes, focal lengths, principal point or distortion
/// are not finite or implausible. Every reader uses this check.
Result<void> check_camera(const PinholeCamera& camera);

}  // namespace hm
