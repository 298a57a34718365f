#include "hm/depth_camera/color_registration.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

const PinholeCamera kCamera{64, 48, 60, 60, 31.5, 23.5, {}};

DepthImage wall_at(double depth_m) {
  return {Image<std::uint16_t>(kCamera.width, kCamera.height, static_cast<std::uint16_t>(1000 * depth_m)),
          1e-3};
}

/// Red grows to the right, green downwards; linear, so that bilinear values are exact.
Image<Rgb8> ramps() {
  Image<Rgb8> image(kCamera.width, kCamera.height);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x)
      image(x, y) = {static_cast<std::uint8_t>(3 * x), static_cast<std::uint8_t>(4 * y), 7};
  return image;
}

/// Checks pixels that the colour image shows.
void expect_color_of(const Image<Rgb8>& registered, const ColorRegistration& registration, double depth_m) {
  const Vec2 principal_point(kCamera.cx, kCamera.cy);
  for (int y = 8; y < 40; ++y)
    for (int x = 12; x < 52; ++x) {
      const Vec2 at = registration.color_pixel(Vec2(x, y), principal_point, 1 / depth_m);
      ASSERT_NEAR(registered(x, y).r, 3 * at.x(), 0.501) << x << ' ' << y;
      ASSERT_NEAR(registered(x, y).g, 4 * at.y(), 0.501) << x << ' ' << y;
      ASSERT_EQ(registered(x, y).b, 7);
    }
}

TEST(ColorRegistration, ImagesThatAreRegisteredStayAsTheyAre) {
  const Image<Rgb8> image = ramps();
  const Image<Rgb8> same = register_color(image, wall_at(2), kCamera, {});
  EXPECT_TRUE(std::ranges::equal(same.pixels(), image.pixels()));
}

TEST(ColorRegistration, PixelsFollowScaleShiftAndDepth) {
  const ColorRegistration registration{0.9, {2.25, -1.5}, 6};
  for (const double depth_m : {1.0, 2.0, 5.0})
    expect_color_of(register_color(ramps(), wall_at(depth_m), kCamera, registration), registration, depth_m);
}

TEST(ColorRegistration, ACameraThatStandsBesideSeesAPointThere) {
  // 3 cm to the left, 0.9 of the focal length: projected by hand.
  constexpr double kLeft_m = 0.03, kFocal_px = 54;
  const ColorRegistration registration{kFocal_px / kCamera.fx, Vec2::Zero(), kFocal_px * kLeft_m};
  const Vec3 point(0.2, -0.1, 1.6);
  const Vec2 in_color(kFocal_px * (point.x() + kLeft_m) / point.z() + kCamera.cx,
                      kFocal_px * point.y() / point.z() + kCamera.cy);
  EXPECT_LT(
      (registration.color_pixel(kCamera.project(point), {kCamera.cx, kCamera.cy}, 1 / point.z()) - in_color)
          .norm(),
      1e-12);
}

TEST(ColorRegistration, WithoutDepthTheDepthAroundIsTaken) {
  const ColorRegistration registration{1, Vec2::Zero(), 8};
  DepthImage holed = wall_at(2);
  for (int y = 20; y < 31; ++y)
    for (int x = 25; x < 39; ++x) holed.units(x, y) = 0;
  expect_color_of(register_color(ramps(), holed, kCamera, registration), registration, 2);
  const DepthImage nothing = wall_at(0);  // as if far away
  const Image<Rgb8> far = register_color(ramps(), nothing, kCamera, registration);
  EXPECT_EQ(far(30, 20).r, 90);
}

}  // namespace
}  // namespace hm
