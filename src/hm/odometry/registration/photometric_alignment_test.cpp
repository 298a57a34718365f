#include "hm/odometry/registration/photometric_alignment.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace hm {
namespace {

/// In an image with a linear brightness gradient, the derivative with respect to the motion is exact: it must
/// agree with the brightness at the moved point.
TEST(PhotometricAlignment, JacobianIsTheNumericOne) {
  const PinholeCamera camera{480, 160, 390, 410, 231.3, 82.7, {}};
  constexpr double kRight = 5, kDown = 4;  // brightness per pixel of level 2, which begins anew every 20
  Image<std::uint8_t> gray(480, 160);
  DepthImage depth{Image<std::uint16_t>(480, 160), 1e-3};
  for (int y = 0; y < 160; ++y)
    for (int x = 0; x < 480; ++x) {
      gray(x, y) = static_cast<std::uint8_t>(5 * (x / 4 % 20) + 4 * (y / 4 % 20) + 20);
      depth.units(x, y) = static_cast<std::uint16_t>(1200 + 2 * (x / 4) + 3 * (y / 4));
    }
  const PhotometricReference reference(ImagePyramid(gray, 3), make_depth_grid(depth, camera, {}, 10), camera,
                                       5000);
  ASSERT_EQ(reference.levels().size(), 1U);
  const PhotometricReference::Level& level = reference.levels().front();
  std::size_t compared = 0;
  for (const PhotometricReference::Pixel& pixel : level.pixels) {
    const Vec3 p = pixel.p_camera.cast<double>();
    const Vec2 seen = level.camera.project(p);
    const int x = static_cast<int>(std::lround(seen.x())) % 20,
              y = static_cast<int>(std::lround(seen.y())) % 20;
    if (x == 0 || x == 19 || y == 0 || y == 19) continue;  // where it begins anew
    const auto brightness = [&](const Vec6& step) {
      const Vec2 at = level.camera.project(SE3::exp(step) * p);
      return kRight * (at.x() - seen.x()) + kDown * (at.y() - seen.y());
    };
    Vec6 numeric;
    for (int i = 0; i < 6; ++i)
      numeric[i] = (brightness(1e-6 * Vec6::Unit(i)) - brightness(-1e-6 * Vec6::Unit(i))) / 2e-6;
    ASSERT_LT((pixel.jacobian.cast<double>() - numeric).norm(), 1e-4 * numeric.norm()) << seen.transpose();
    ++compared;
  }
  EXPECT_GT(compared, 1000U);
}

}  // namespace
}  // namespace hm
