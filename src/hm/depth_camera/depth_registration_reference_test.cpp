#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hm/depth_camera/depth_registration.hpp"
#include "hm/depth_camera/registration_test_support.hpp"
#include "hm/io/testing/testing_recordings.hpp"

/// DepthRegistration against a slow reference.
namespace hm {
namespace {

using namespace testing_recordings;
using namespace registration_test;

struct Rig {
  PinholeCamera depth_camera;
  SE3 T_color_depth;
  PinholeCamera color_camera;
};

/// Registration in double precision, one reading after the other. Removes readings from `depth` that are
/// within `margin` of a pixel or unit border, or within 3 units of the other camera's plane, where single
/// precision may decide differently.
Image<std::uint16_t> registered_slowly(Image<std::uint16_t>& depth, double unit_m, double margin,
                                       const Rig& rig) {
  const auto& [depth_camera, motion, color_camera] = rig;
  Image<std::uint16_t> registered(color_camera.width, color_camera.height);
  const auto near_border = [&](double value) {
    const double fraction = value + 0.5 - std::floor(value + 0.5);
    return fraction < margin || fraction > 1 - margin;
  };
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x) {
      if (depth(x, y) == 0) continue;
      const Vec3 p = motion * depth_camera.unproject(Vec2(x, y), depth(x, y) * unit_m);
      const double z = p.z() / unit_m;
      const Vec2 pixel = color_camera.project(p);
      if (std::abs(z) < 3 || near_border(z) || near_border(pixel.x()) || near_border(pixel.y())) {
        depth(x, y) = 0;
        continue;
      }
      if (z < 0.5 || z >= 65535.5 || !color_camera.contains(pixel)) continue;
      std::uint16_t& place =
          registered(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
      const auto units = static_cast<std::uint16_t>(std::lround(z));
      if (place == 0 || units < place) place = units;
    }
  Image<std::uint16_t> filled = registered;
  const auto between = [](std::uint16_t a, std::uint16_t b) {
    const int mean = (a + b + 1) / 2;
    return static_cast<std::uint16_t>(a == 0 || b == 0 || std::abs(a - b) > mean * 1966 / 65536 ? 0 : mean);
  };
  for (int y = 0; y < filled.height(); ++y)
    for (int x = 0; x < filled.width(); ++x) {
      if (registered(x, y) != 0) continue;
      if (x > 0 && x + 1 < filled.width()) filled(x, y) = between(registered(x - 1, y), registered(x + 1, y));
      if (filled(x, y) == 0 && y > 0 && y + 1 < filled.height())
        filled(x, y) = between(registered(x, y - 1), registered(x, y + 1));
    }
  return filled;
}

/// Rigs with cameras side by side; far apart, so that near readings go to any row; rotated about the axis;
/// with little overlap; with a camera of smaller view, and upside down.
const Rig kRigs[] = {{kDepthCamera, kMotion, kColorCamera},
                     {kDepthCamera, SE3(so3_exp(Vec3(0.01, 0, 0.02)), Vec3(0.05, -0.3, 0.01)), kColorCamera},
                     {kDepthCamera, SE3(so3_exp(Vec3(0, 0, 0.7)), Vec3(0.02, 0, 0)), kColorCamera},
                     {kDepthCamera, SE3(so3_exp(Vec3(0.2, -0.4, 0)), Vec3(0, 0.05, -0.1)), kColorCamera},
                     {kDepthCamera, SE3(), {320, 240, 420, 420, 159.7, 120.5, {}}},
                     {kDepthCamera, SE3(), {160, 120, 211, -212, 79.7, 60.9, {}}}};

TEST(DepthRegistrationReference, EveryPixelIsThatOfTheSlowReference) {
  for (const Rig& rig : kRigs) {
    const DepthRegistration registration(rig.depth_camera, rig.color_camera, rig.T_color_depth);
    for (const double unit_m : {1e-3, 2e-4, 1.0}) {
      Rng rng(3);
      for (const double scatter : {0.0, 0.01, 1.0}) {
        Image<std::uint16_t> depth(160, 120);
        for (int y = 0; y < 120; ++y)
          for (int x = 0; x < 160; ++x)
            if (rng.below(8) != 0)
              depth(x, y) = static_cast<std::uint16_t>(
                  std::clamp((1.2 + 0.01 * x + scatter * rng.normal()) / unit_m, 0.0, 65535.0));
        const auto wanted = registered_slowly(depth, unit_m, 2e-3, rig);
        EXPECT_TRUE(same_pixels(registration.apply(depth, unit_m), wanted)) << unit_m << ", " << scatter;
      }
    }
  }
}

PinholeCamera random_camera(Rng& rng) {
  const auto size = [&] { return 1 + static_cast<int>(rng.below(rng.below(3) == 0 ? 8 : 200)); };
  const int width = size(), height = size();
  const double f = std::max(width, height) * rng.uniform(0.3, 2.5);
  const double fy = f * rng.uniform(0.9, 1.1) * (rng.below(20) == 0 ? -1 : 1);
  return {width, height, f, fy, width * rng.uniform(-0.2, 1.2), height * rng.uniform(0.3, 0.7), {}};
}

/// Side by side or up to 1 m apart, looking much the same way or anywhere.
Rig random_rig(Rng& rng) {
  const double turn = rng.below(4) == 0 ? 3.0 : rng.below(3) == 0 ? 0.3 : 0.02;
  const double move_m = rng.below(4) == 0 ? 1.0 : 0.05;
  const auto vector = [&](double largest) {
    return Vec3(largest * Vec3(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)));
  };
  const PinholeCamera depth_camera = random_camera(rng);
  const SE3 T_color_depth(so3_exp(vector(turn)), vector(move_m));
  return {depth_camera, T_color_depth, random_camera(rng)};
}

/// All that 16 bits hold; a surface; clutter, some of it near; a surface with some readings as far as can be.
Image<std::uint16_t> random_depths(Rng& rng, const PinholeCamera& camera, double unit_m) {
  Image<std::uint16_t> depth(camera.width, camera.height);
  const std::uint64_t kind = rng.below(4);
  for (auto& units : depth.pixels()) {
    const double z_m = kind == 0   ? rng.uniform(0, 65535) * unit_m
                       : kind == 1 ? 1.2 + 0.002 * static_cast<double>(rng.below(5))
                       : kind == 2 ? rng.uniform(0.1, 3.1)
                                   : (rng.below(50) == 0 ? 65535 * unit_m : 2.0);
    units = static_cast<std::uint16_t>(rng.below(8) == 0 ? 0 : std::clamp(z_m / unit_m, 0.0, 65535.0));
  }
  return depth;
}

TEST(DepthRegistrationReference, RandomRigsIntoImagesThatAreUsedAgain) {
  Rng rng(11);
  for (int round = 0; round < 300; ++round) {
    const Rig rig = random_rig(rng);
    const DepthRegistration registration(rig.depth_camera, rig.color_camera, rig.T_color_depth);
    Image<std::uint16_t> registered;
    for (int image = 0; image < 2; ++image) {
      const double unit_m = std::pow(10.0, rng.uniform(-5, 0.3));
      Image<std::uint16_t> depth = random_depths(rng, rig.depth_camera, unit_m);
      const auto wanted = registered_slowly(depth, unit_m, 2e-2, rig);
      registration.apply(depth, unit_m, registered);
      ASSERT_TRUE(same_pixels(registered, wanted)) << "round " << round << ", image " << image;
    }
  }
}

}  // namespace
}  // namespace hm
