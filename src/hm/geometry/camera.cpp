#include "hm/geometry/camera.hpp"

#include <cmath>

namespace hm {
namespace {

/// Brown-Conrady: undistorted to distorted coordinates on the plane z = 1.
Vec2 distort(const LensDistortion& d, const Vec2& p) {
  const double x = p.x(), y = p.y(), r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (d.k1 + r2 * (d.k2 + r2 * d.k3));
  return {x * radial + 2.0 * d.p1 * x * y + d.p2 * (r2 + 2.0 * x * x),
          y * radial + d.p1 * (r2 + 2.0 * y * y) + 2.0 * d.p2 * x * y};
}

Vec2 undistort(const LensDistortion& d, const Vec2& distorted) {
  Vec2 p = distorted;
  for (int i = 0; i < 50; ++i) {
    const Vec2 error = distort(d, p) - distorted;
    p -= error;
    if (error.squaredNorm() < 1e-22) break;
  }
  return p;
}

}  // namespace

Vec2 PinholeCamera::project(const Vec3& p_camera) const {
  Vec2 p = p_camera.head<2>() / p_camera.z();
  if (!distortion.is_zero()) p = distort(distortion, p);
  return {fx * p.x() + cx, fy * p.y() + cy};
}

Vec3 PinholeCamera::unproject(const Vec2& pixel, double depth_m) const {
  Vec2 p((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  if (!distortion.is_zero()) p = undistort(distortion, p);
  return {p.x() * depth_m, p.y() * depth_m, depth_m};
}

PinholeCamera PinholeCamera::without_distortion() const {
  PinholeCamera camera = *this;
  camera.distortion = {};
  return camera;
}

PinholeCamera PinholeCamera::scaled(double ratio) const {
  PinholeCamera camera = *this;
  camera.width = static_cast<int>(std::lround(width * ratio));
  camera.height = static_cast<int>(std::lround(height * ratio));
  camera.fx = fx * ratio;
  camera.fy = fy * ratio;
  camera.cx = (cx + 0.5) * ratio - 0.5;
  camera.cy = (cy + 0.5) * ratio - 0.5;
  return camera;
}

Result<void> check_camera(const PinholeCamera& camera) {
  // Images have at most 32768 pixels per side; a field of view below a degree or near 180 degrees is a
  // mistake in a file. An unknown size counts as one pixel.
  constexpr double kMaxFocal_px = 1e6, kMinFocalPerWidth = 0.01, kMaxPrincipal_px = 1e5, kMaxDistortion = 1e4;
  const auto wrong = [](const char* name, double value) {
    return fail(ErrorCode::kInvalidValue, "", "camera {} = {} cannot be right", name, value);
  };
  const auto beyond = [](double value, double low, double high) {
    return !(std::abs(value) >= low && std::abs(value) <= high);
  };
  if (camera.width < 1 || camera.width > 32768) return wrong("width", camera.width);
  if (camera.height < 1 || camera.height > 32768) return wrong("height", camera.height);
  if (camera.fx <= 0 || beyond(camera.fx, kMinFocalPerWidth * camera.width, kMaxFocal_px))
    return wrong("fx", camera.fx);
  if (beyond(camera.fy, kMinFocalPerWidth * camera.height, kMaxFocal_px)) return wrong("fy", camera.fy);
  if (beyond(camera.cx, 0, kMaxPrincipal_px)) return wrong("cx", camera.cx);
  if (beyond(camera.cy, 0, kMaxPrincipal_px)) return wrong("cy", camera.cy);
  const auto& d = camera.distortion;
  for (const double k : {d.k1, d.k2, d.p1, d.p2, d.k3})
    if (beyond(k, 0, kMaxDistortion)) return wrong("distortion", k);
  return {};
}

}  // namespace hm
