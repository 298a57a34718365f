#include "hm/calibration/depth_fit.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "hm/calibration/calibration_test_support.hpp"

namespace hm {
namespace {

using namespace testing_calibration;
using testing::HasSubstr;

TEST(DepthAverage, MissingReadingsDoNotCount) {
  DepthAverage average(2, 1);
  for (const int units : {1000, 0, 1010, 0, 990}) {
    DepthImage depth{Image<std::uint16_t>(2, 1), 1e-3};
    depth.units(0, 0) = static_cast<std::uint16_t>(units);
    average.add(depth);
  }
  EXPECT_EQ(average.images(), 5);
  EXPECT_EQ(average.count(0, 0), 3);
  EXPECT_NEAR(average.mean_m(0, 0), 1.0, 1e-12);
  EXPECT_NEAR(average.sigma_m(0, 0), 0.01, 1e-12);
  EXPECT_EQ(average.count(1, 0), 0);
  EXPECT_EQ(average.mean_m(1, 0), 0);
}

/// Error-free readings of a tilted board have zero error; missing readings and an occluder give no sample.
TEST(DepthReference, APlaneIsThePlane) {
  const BoardParams board{BoardKind::kCheckerboard, 9, 6, 0.1, 0.75};
  const PinholeCamera camera = kDepthCamera.without_distortion();
  Rng rng(3);
  const SE3 T = random_pose(camera, board, 2.0, rng);
  DepthImage depth{Image<std::uint16_t>(640, 480), 1e-4};
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 640; ++x) {
      const Vec3 n = T.rotation().col(2);
      const double z = n.dot(T.translation()) / n.dot(camera.unproject(Vec2(x, y), 1));
      depth.units(x, y) = static_cast<std::uint16_t>(x % 10 == 0 ? 0 : std::lround(z * 1e4));
      if (x % 10 == 1) depth.units(x, y) = 9000;  // 0.9 m: a hand
    }
  DepthAverage average(640, 480);
  average.add(depth);
  const auto result = compare_with_board({average, camera, T, board}, 0.5);
  ASSERT_GT(result.view.samples.size(), 5000u);
  for (const DepthSample& sample : result.view.samples) {
    ASSERT_NEAR(sample.measured_m, sample.true_m, 6e-5);
    ASSERT_NEAR(sample.true_m, plane_depth_m(camera, T, Vec2(sample.x, sample.y)), 1e-6);
  }
  const auto share = static_cast<double>(result.view.samples.size());
  EXPECT_NEAR(static_cast<double>(result.no_reading) / share, 1 / 8.0, 0.02);
  EXPECT_NEAR(static_cast<double>(result.off_plane) / share, 1 / 8.0, 0.02);
}

/// A board that faces the camera: its outline is known, 0.6 of a square beyond the outer corners.
TEST(DepthReference, TheOutlineIsSixTenthsOfASquareBeyondTheCorners) {
  const BoardParams board{BoardKind::kCheckerboard, 5, 4, 0.1, 0.75};
  const PinholeCamera camera{640, 480, 500, 500, 320, 240, {}};
  DepthAverage average(640, 480);
  average.add({Image<std::uint16_t>(640, 480, 2000), 1e-3});
  const auto result =
      compare_with_board({average, camera, SE3(Mat3::Identity(), Vec3(-0.2, -0.15, 2)), board}, 0.5);
  int left = 640, right = 0, top = 480, bottom = 0;
  for (const DepthSample& sample : result.view.samples) {
    left = std::min<int>(left, sample.x), right = std::max<int>(right, sample.x);
    top = std::min<int>(top, sample.y), bottom = std::max<int>(bottom, sample.y);
  }
  EXPECT_NEAR(left, 320 - 250 * 0.26, 1);
  EXPECT_NEAR(right, 320 + 250 * 0.26, 1);
  EXPECT_NEAR(top, 240 - 250 * 0.21, 1);
  EXPECT_NEAR(bottom, 240 + 250 * 0.21, 1);
}

constexpr int kWidth = 80, kHeight = 60;

double smooth_bias(int x, int y, double z) {
  const double u = 2.0 * x / kWidth - 1, v = 2.0 * y / kHeight - 1;
  return 0.05 * (z / 4) * (z / 4) * (u * u - 0.5 * v + 0.3 * std::sin(2 * v));
}

std::vector<DepthView> training_set(double sigma_m) {
  Rng rng(11);
  std::vector<DepthView> views;
  for (double z = 1; z < 4.1; z += 0.5)
    views.push_back(whole_image(kWidth, kHeight, z, sigma_m, smooth_bias, rng));
  return views;
}

TEST(DepthFit, TheSplineFollowsASmoothBias) {
  const auto fit = fit_depth_correction(training_set(0.002), kWidth, kHeight);
  ASSERT_TRUE(fit) << to_string(fit.error());
  Rng rng(12);
  for (const double z : {1.2, 2.3, 3.4, 3.9}) {
    const DepthViewError error =
        evaluate_correction(whole_image(kWidth, kHeight, z, 0, smooth_bias, rng), fit->model);
    EXPECT_LT(error.after_rms_m, 0.0006) << z;
    EXPECT_GT(error.before_rms_m, 4 * error.after_rms_m) << z;
  }
  EXPECT_NEAR(fit->model.min_depth_m, 1.0, 0.02);
  EXPECT_NEAR(fit->model.max_depth_m, 4.05, 0.05);
  EXPECT_EQ(fit->fitted_pixel_ratio, 1.0);
}

/// Each of the dissertation's modes finds the coefficients of a bias of its own kind at every pixel.
TEST(DepthFit, PixelModesFindTheirOwnPolynomials) {
  struct Case {
    DepthFitMode mode;
    double c0, c1, c2;  // true = c0 + c1 d + c2 d^2
  };
  for (const Case& c :
       {Case{DepthFitMode::kLinear, 0.02, 0.98, 0}, Case{DepthFitMode::kLinearZero, 0, 1.03, 0},
        Case{DepthFitMode::kQuadratic, -0.01, 1.01, -0.004},
        Case{DepthFitMode::kQuadraticZero, 0, 0.99, 0.006}}) {
    std::vector<DepthView> views;
    for (double d = 1; d < 4.1; d += 0.25) {
      DepthView view;
      for (int y = 0; y < 30; ++y)
        for (int x = 0; x < 40; ++x)
          view.samples.push_back({static_cast<std::int16_t>(x), static_cast<std::int16_t>(y),
                                  static_cast<float>(d), static_cast<float>(c.c0 + c.c1 * d + c.c2 * d * d),
                                  0.001F});
      views.push_back(std::move(view));
    }
    DepthFitParams params;
    params.mode = c.mode;
    params.window_px = 5;
    const auto fit = fit_depth_correction(views, 40, 30, params);
    ASSERT_TRUE(fit);
    for (const double d : {1.1, 2.0, 3.7})
      EXPECT_NEAR(fit->model.correction_m(Vec2(17, 12), d), c.c0 + (c.c1 - 1) * d + c.c2 * d * d, 2e-4)
          << kDepthFitModeNames[static_cast<std::size_t>(c.mode)] << " at " << d;
  }
}

/// Pixels without samples are not corrected; depth ranges are those of each pixel's own window.
TEST(DepthFit, PixelModesKnowWhereTheyWereTrained) {
  std::vector<DepthView> views;
  for (double z = 1; z < 4.1; z += 0.5) {
    DepthView view;
    for (int y = 0; y < 30; ++y)
      for (int x = 0; x < 20; ++x)
        if (x < 10 || z < 2.2)  // the right part was observed at short range only
          view.samples.push_back({static_cast<std::int16_t>(x), static_cast<std::int16_t>(y),
                                  static_cast<float>(z), static_cast<float>(1.02 * z * z / (z + 0.01)),
                                  0.001F});
    views.push_back(std::move(view));
  }
  DepthFitParams params;
  params.mode = DepthFitMode::kQuadratic;
  params.window_px = 3;
  const auto fit = fit_depth_correction(views, 40, 30, params);
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->model.correction_m(Vec2(35, 10), 2), 0) << "never seen";
  const double at_end = fit->model.correction_m(Vec2(15, 10), 2.0);
  EXPECT_DOUBLE_EQ(fit->model.correction_m(Vec2(15, 10), 4.0), at_end)
      << "held where this pixel's training ends";
  EXPECT_NE(fit->model.correction_m(Vec2(5, 10), 4.0), fit->model.correction_m(Vec2(5, 10), 2.0));
  EXPECT_NEAR(fit->fitted_pixel_ratio, 21 / 40.0, 1e-9);
}

/// A hand in front of the board in one view: the fit does not follow it.
TEST(DepthFit, OutliersAreOutvoted) {
  auto views = training_set(0.002);
  for (DepthSample& sample : views[3].samples)
    if (sample.x < 12 && sample.y < 12) sample.measured_m -= 0.3F;
  const auto fit = fit_depth_correction(views, kWidth, kHeight);
  ASSERT_TRUE(fit);
  Rng rng(12);
  EXPECT_LT(
      evaluate_correction(whole_image(kWidth, kHeight, 2.5, 0, smooth_bias, rng), fit->model).after_rms_m,
      0.004);
}

TEST(DepthFit, UnusableSetsAreErrors) {
  EXPECT_FALSE(fit_depth_correction({}, kWidth, kHeight));
  Rng rng(1);
  const std::vector<DepthView> one{whole_image(kWidth, kHeight, 2, 0.001, smooth_bias, rng)};
  const auto fit = fit_depth_correction(one, kWidth, kHeight);
  ASSERT_FALSE(fit);
  EXPECT_THAT(fit.error().message, HasSubstr("2.0"));
}

}  // namespace
}  // namespace hm
