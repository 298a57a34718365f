#include "hm/sim/sensor/calibration_rig.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/core/statistics.hpp"

namespace hm {
namespace {

/// A picture that is black on its left half: the edge is seen where the camera model says.
TEST(FlatRenderer, AnEdgeIsWhereItBelongs) {
  const CalibrationRig rig = xtion_rig();
  const FlatRenderer renderer(rig.color_camera);
  Image<std::uint8_t> gray(400, 300, 255);
  for (int y = 0; y < 300; ++y)
    for (int x = 0; x < 200; ++x) gray(x, y) = 0;
  const FlatPicture picture{gray, 0.001};
  const SE3 T(so3_exp(Vec3(0.2, -0.3, 0.05)), Vec3(-0.22, -0.15, 0.6));
  Rng rng(1);
  const Image<Rgb8> seen = renderer.render(picture, T, 0, rng);
  for (double y_m = 0.05; y_m < 0.26; y_m += 0.02) {
    const Vec2 edge = rig.color_camera.project(T * Vec3(0.2, y_m, 0));
    // The grey levels of a row, from black to white, determine the edge to a fraction of a pixel.
    const int row = static_cast<int>(std::lround(edge.y())), from = static_cast<int>(edge.x()) - 8;
    double white = 0;
    for (int x = from; x < from + 16; ++x) white += (seen(x, row).g - 30) / (0.75 * 255);
    const Vec2 next = rig.color_camera.project(T * Vec3(0.2, y_m + 0.01, 0));
    const double at_row = edge.x() + (row - edge.y()) * (next.x() - edge.x()) / (next.y() - edge.y());
    EXPECT_NEAR(from + 16 - 0.5 - white, at_row, 0.06) << y_m;
  }
}

TEST(FlatRenderer, DepthIsThatOfThePlane) {
  const CalibrationRig rig = xtion_rig();
  const FlatRenderer renderer(rig.depth_camera);
  const Image<std::uint8_t> gray(300, 200, 200);
  const FlatPicture picture{gray, 0.002};
  const SE3 T(so3_exp(Vec3(0.4, 0.2, 0.1)), Vec3(-0.3, -0.2, 1.5));
  const Image<float> depth = renderer.depth_m(picture, T);
  int seen = 0;
  for (int y = 0; y < 480; y += 3)
    for (int x = 0; x < 640; x += 3) {
      const auto z = static_cast<double>(depth(x, y));
      if (z == 0) continue;
      ++seen;
      const Vec3 p = T.inverse() * rig.depth_camera.unproject(Vec2(x, y), z);
      ASSERT_NEAR(p.z(), 0, 1e-6);
      ASSERT_TRUE(p.x() > -1e-6 && p.x() < 0.6001 && p.y() > -1e-6 && p.y() < 0.4001);
    }
  EXPECT_GT(seen, 1000);
}

TEST(CalibrationRig, WarpAndNoiseAreAsStated) {
  const CalibrationRig rig = xtion_rig();
  double largest = 0;
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 640; ++x) largest = std::max(largest, std::abs(simulated_warp_m(rig, Vec2(x, y), 4)));
  EXPECT_NEAR(largest, rig.warp_at_4m_m, 0.002);
  EXPECT_EQ(simulated_warp_m(rig, Vec2(100, 100), 0), 0);

  Image<float> depth(640, 480, 3.0F);
  Rng rng(2);
  const DepthImage sensed = sense_flat(rig, depth, rng);
  std::vector<double> errors;
  std::size_t missing = 0;
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 640; ++x) {
      if (sensed.units(x, y) == 0) {
        ++missing;
        continue;
      }
      errors.push_back(sensed.depth_m(x, y) - 3 - simulated_warp_m(rig, Vec2(x, y), 3));
    }
  EXPECT_NEAR(summarise(errors).mean, 0, 1e-4);
  EXPECT_NEAR(summarise(errors).rmse, 0.001425 * 9, 1e-4);
  EXPECT_NEAR(static_cast<double>(missing) / (640 * 480), rig.dropout_ratio, 0.001);
  const DepthImage nothing = sense_flat(rig, Image<float>(640, 480, 0.0F), rng);
  for (const std::uint16_t units : nothing.units.pixels()) ASSERT_EQ(units, 0);
}

TEST(PlacePicture, MiddleIsSeenWhereItWasAsked) {
  const CalibrationRig rig = xtion_rig();
  const Image<std::uint8_t> gray(300, 200);
  const FlatPicture picture{gray, 0.001};
  const FlatView view{Vec2(150, 300), 0.7, 0.5, 1.0, 0.2};
  const SE3 T = place_picture(rig.color_camera, picture, view);
  EXPECT_LT((rig.color_camera.project(T * Vec3(0.15, 0.1, 0)) - view.pixel).norm(), 1e-6);
  EXPECT_NEAR((T * Vec3(0.15, 0.1, 0)).z(), 0.7, 1e-12);
  EXPECT_TRUE(sees_whole(rig.color_camera, picture, T, 4));
  EXPECT_FALSE(sees_whole(rig.color_camera, picture, T, 200));
}

}  // namespace
}  // namespace hm
