#include "hm/depth_camera/depth_registration.hpp"

#include <gmock/gmock.h>

#include <hwy/targets.h>
#include <array>
#include <cmath>

#include "hm/depth_camera/registration_test_support.hpp"
#include "hm/io/testing/testing_recordings.hpp"

namespace hm {
namespace {

using namespace testing_recordings;
using namespace registration_test;

/// Depth of a plane n . p = d, seen by a camera.
double plane_depth(const PinholeCamera& camera, const Vec2& pixel, const Vec3& n, double d) {
  return d / n.dot(camera.unproject(pixel, 1.0));
}

TEST(DepthRegistration, APlaneStaysThePlane) {
  const Vec3 n_depth = Vec3(0.2, -0.1, 1).normalized();
  const double d_depth = 2.0;
  Image<std::uint16_t> depth(160, 120);
  const double unit = 1e-4;
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x)
      depth(x, y) = static_cast<std::uint16_t>(
          std::lround(plane_depth(kDepthCamera, Vec2(x, y), n_depth, d_depth) / unit));
  const auto registered = DepthRegistration(kDepthCamera, kColorCamera, kMotion).apply(depth, unit);
  const Vec3 n_color = kMotion.rotation() * n_depth;
  const double d_color = d_depth + n_color.dot(kMotion.translation());
  int inside = 0, holes = 0;
  double sum = 0, worst = 0;
  for (int y = 8; y < 112; ++y)
    for (int x = 8; x < 152; ++x) {
      ++inside;
      if (registered(x, y) == 0) {
        ++holes;
        continue;
      }
      const double error = registered(x, y) * unit - plane_depth(kColorCamera, Vec2(x, y), n_color, d_color);
      sum += error;
      worst = std::max(worst, std::abs(error));
    }
  EXPECT_EQ(holes, 0) << "of " << inside;
  // A reading moves by up to half a pixel: up to 1.7 mm here. Truncating instead of rounding would shift the
  // mean.
  EXPECT_LT(worst, 0.0035);
  EXPECT_LT(std::abs(sum / inside), 2e-4);
}

TEST(DepthRegistration, EveryInstructionSetGivesTheSameBits) {
  const DepthRegistration registration(kDepthCamera, kColorCamera, kMotion);
  const Image<std::uint16_t> depth = testing_recordings::random_depth(160, 120, 8).units;
  Image<std::uint16_t> wanted;
  for (std::int64_t left = hwy::SupportedTargets(); left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left & -left);
    const Image<std::uint16_t> registered = registration.apply(depth, 1e-3);
    if (wanted.empty()) wanted = registered;
    EXPECT_TRUE(same_pixels(registered, wanted)) << hwy::TargetName(left & -left);
  }
  hwy::SetSupportedTargetsForTest(0);
}

/// Widths that are no whole blocks, and a colour camera with fewer pixels than the depth camera has columns.
TEST(DepthRegistration, CamerasOfAnySize) {
  for (const auto& [width, height, color_width, color_height] :
       {std::array{157, 119, 160, 120}, {33, 5, 97, 70}, {160, 7, 3, 2}, {1, 1, 40, 30}}) {
    const int cx = width / 2, cy = height / 2, color_cx = color_width / 2, color_cy = color_height / 2;
    const PinholeCamera from{width, height, 145, 144, double(cx), double(cy), {}};
    const PinholeCamera to{color_width, color_height, 145, 144, double(color_cx), double(color_cy), {}};
    const Image<std::uint16_t> depth(width, height, 2000);
    const auto registered = DepthRegistration(from, to, SE3()).apply(depth, 1e-3);
    for (int y = 0; y < color_height; ++y)
      for (int x = 0; x < color_width; ++x)
        ASSERT_EQ(registered(x, y), depth.contains(x - color_cx + cx, y - color_cy + cy) ? 2000 : 0)
            << x << ", " << y << ": " << width << " to " << color_width;
  }
}

/// Single precision rounds them to either row.
TEST(DepthRegistration, ReadingsBetweenTwoRowsGoToOneOfThem) {
  PinholeCamera lower = kDepthCamera;
  lower.cy += 0.5;
  const DepthRegistration registration(kDepthCamera, lower, SE3());
  for (int y = 0; y < 119; ++y) {
    Image<std::uint16_t> depth(160, 120);
    std::ranges::fill(depth.row(y), std::uint16_t{2000});
    const auto registered = registration.apply(depth, 1e-3);
    for (int x = 0; x < 160; ++x)
      ASSERT_EQ(std::max(registered(x, y), registered(x, y + 1)), 2000) << x << ", " << y;
  }
}

TEST(DepthRegistration, NearestReadingWins) {
  Image<std::uint16_t> depth(160, 120);
  // Two readings on one ray of the colour camera.
  const Vec3 ray = kColorCamera.unproject(Vec2(70, 50), 1.0);
  const auto place = [&](double z) { return kDepthCamera.project(kMotion.inverse() * Vec3(z * ray)); };
  for (const double z : {1.0, 3.0}) {
    const Vec2 at = place(z);
    depth(static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y()))) =
        static_cast<std::uint16_t>(z * 1000);
  }
  const auto registered = DepthRegistration(kDepthCamera, kColorCamera, kMotion).apply(depth, 1e-3);
  EXPECT_NEAR(registered(70, 50), 1000, 5);
}

TEST(DepthRegistration, FillsOnlyHolesOfOnePixelOnOneSurface) {
  PinholeCamera camera = kDepthCamera;
  Image<std::uint16_t> depth(160, 120, 2000);
  depth(20, 20) = 0;                  // one pixel: filled
  depth(40, 40) = depth(41, 40) = 0;  // two wide, one high: filled from above and below
  for (int y = 59; y < 62; ++y)
    for (int x = 59; x < 62; ++x) depth(x, y) = 0;  // three by three: stays
  for (int y = 80; y < 90; ++y) {                   // a gap between two depths: stays
    for (int x = 81; x < 90; ++x) depth(x, y) = 3000;
    depth(80, y) = 0;
  }
  const auto same = DepthRegistration(camera, camera, SE3()).apply(depth, 1e-3);
  EXPECT_EQ(same(20, 20), 2000);
  EXPECT_EQ(same(40, 40), 2000);
  EXPECT_EQ(same(60, 60), 0);
  EXPECT_EQ(same(59, 59), 0);
  EXPECT_EQ(same(80, 85), 0);
}

}  // namespace
}  // namespace hm
