#include "hm/depth_camera/depth_correction.hpp"

#include <gtest/gtest.h>

#include <hwy/targets.h>
#include <algorithm>
#include <cmath>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

/// A model with random coefficients.
DepthCorrectionModel random_model(DepthFitMode mode, int width, int height) {
  Rng rng(1);
  DepthCorrectionModel model;
  model.mode = mode;
  model.width = width, model.height = height;
  const bool smooth = mode == DepthFitMode::kSpline;
  model.columns = smooth ? 7 : width, model.rows = smooth ? 6 : height;
  model.terms = 3;
  model.min_depth_m = 0.8, model.max_depth_m = 4.0;
  const auto plane = static_cast<std::size_t>(model.columns * model.rows);
  for (std::size_t i = 0; i < 3 * plane; ++i)
    model.coefficients.push_back(static_cast<float>(rng.uniform(-0.15, 0.15)));
  for (std::size_t i = 0; i < plane && !smooth; ++i) {
    model.lowest_s.push_back(static_cast<float>(rng.uniform(-1, -0.5)));
    model.highest_s.push_back(static_cast<float>(rng.uniform(0, 1)));
  }
  return model;
}

DepthImage random_depth(int width, int height, std::uint64_t seed) {
  Rng rng(seed);
  DepthImage depth{Image<std::uint16_t>(width, height), 1e-3};
  for (auto& units : depth.units.pixels())
    units = static_cast<std::uint16_t>(rng.below(5) == 0 ? 0 : 300 + rng.below(6000));
  return depth;
}

class EveryMode : public testing::TestWithParam<DepthFitMode> {};

TEST_P(EveryMode, FastPathIsTheReference) {
  for (const auto& [width, height] : {std::pair{64, 48}, {61, 37}, {640, 480}}) {
    const DepthCorrectionModel model = random_model(GetParam(), width, height);
    const DepthCorrection correction(model, width, height);
    const DepthImage before = random_depth(width, height, 7);
    DepthImage after = before;
    correction.apply(after);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        if (before.units(x, y) == 0) {
          ASSERT_EQ(after.units(x, y), 0) << "no reading became one at " << x << ", " << y;
          continue;
        }
        const double d = before.depth_m(x, y);
        const double wanted = std::max(1.0, (d + model.correction_m(Vec2(x, y), d)) / before.unit_m);
        ASSERT_NEAR(after.units(x, y), wanted, 0.51) << x << ", " << y;
      }
  }
}

TEST_P(EveryMode, HeldAtTheEndsOfTheTrainedRange) {
  const DepthCorrectionModel model = random_model(GetParam(), 32, 24);
  for (int y = 0; y < 24; y += 5)
    for (int x = 0; x < 32; x += 5) {
      EXPECT_DOUBLE_EQ(model.correction_m(Vec2(x, y), 4.0), model.correction_m(Vec2(x, y), 9.0));
      EXPECT_DOUBLE_EQ(model.correction_m(Vec2(x, y), 0.8), model.correction_m(Vec2(x, y), 0.1));
    }
}

TEST_P(EveryMode, SmallerImagesGetTheSameCorrectionAtTheSamePlace) {
  const DepthCorrectionModel model = random_model(GetParam(), 64, 48);
  const DepthCorrection half(model, 32, 24);
  DepthImage depth{Image<std::uint16_t>(32, 24, 2000), 1e-3};
  half.apply(depth);
  for (int y = 0; y < 24; ++y)
    for (int x = 0; x < 32; ++x) {
      const Vec2 place(2 * x + 0.5, 2 * y + 0.5);  // pixel cells: two by two become one
      EXPECT_NEAR(depth.units(x, y), 2000 + 1000 * model.correction_m(place, 2.0), 0.51);
    }
}

TEST_P(EveryMode, EveryUnitAndNumberOfTerms) {
  for (const double unit_m : {1e-3, 2e-4, 1e-4, 2.5e-3, 1.0})
    for (const int terms : {1, 2, 3, 4}) {
      DepthCorrectionModel model = random_model(GetParam(), 61, 37);
      model.terms = terms;
      model.coefficients.resize(static_cast<std::size_t>(terms * model.columns * model.rows), 0.003F);
      Rng rng(5);
      DepthImage before{Image<std::uint16_t>(61, 37), unit_m};
      for (auto& units : before.units.pixels())
        units = static_cast<std::uint16_t>(rng.below(5) == 0 ? 0 : rng.uniform(0.5, 6.0) / unit_m);
      DepthImage after = before;
      DepthCorrection(model, 61, 37).apply(after);
      for (int y = 0; y < 37; ++y)
        for (int x = 0; x < 61; ++x) {
          if (before.units(x, y) == 0) continue;
          const double d = before.depth_m(x, y);
          const double wanted = (d + model.correction_m(Vec2(x, y), d)) / unit_m;
          ASSERT_NEAR(after.units(x, y), std::clamp(wanted, 1.0, 65535.0), 0.52) << x << ", " << y;
        }
    }
}

TEST_P(EveryMode, EveryInstructionSetGivesTheSameBits) {
  const DepthCorrection correction(random_model(GetParam(), 201, 97), 201, 97);
  Image<std::uint16_t> wanted;
  for (std::int64_t left = hwy::SupportedTargets(); left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left & -left);
    DepthImage depth = random_depth(201, 97, 3);
    correction.apply(depth);
    if (wanted.empty()) wanted = depth.units;
    EXPECT_TRUE(std::ranges::equal(depth.units.pixels(), wanted.pixels())) << hwy::TargetName(left & -left);
  }
  hwy::SetSupportedTargetsForTest(0);
}

INSTANTIATE_TEST_SUITE_P(Modes, EveryMode, testing::Values(DepthFitMode::kSpline, DepthFitMode::kQuadratic),
                         [](const auto& each) {
                           return std::string(kDepthFitModeNames[static_cast<std::size_t>(each.param)]);
                         });

TEST(DepthCorrection, ConstantControlPointsAreAConstant) {
  DepthCorrectionModel model = random_model(DepthFitMode::kSpline, 100, 80);
  std::fill(model.coefficients.begin(), model.coefficients.end(), 0.0F);
  std::fill_n(model.coefficients.begin(), model.columns * model.rows, 0.025F);
  for (const double z : {0.5, 1.0, 3.0, 5.0})
    EXPECT_NEAR(model.correction_m(Vec2(13.3, 71.2), z), 0.025, 1e-8);
}

/// Splines reproduce straight lines: control points on a line give the line, at the places the header names.
TEST(DepthCorrection, ControlPointsHaveTheirPeakWhereTheHeaderSays) {
  DepthCorrectionModel model = random_model(DepthFitMode::kSpline, 100, 80);
  std::fill(model.coefficients.begin(), model.coefficients.end(), 0.0F);
  for (int j = 0; j < model.rows; ++j)
    for (int i = 0; i < model.columns; ++i)
      model.coefficients[static_cast<std::size_t>(j * model.columns + i)] =
          static_cast<float>(1e-4 * ((i - 1) * 100.0 / (model.columns - 3) - 0.5));
  for (const double x : {0.0, 17.0, 50.5, 99.0})
    EXPECT_NEAR(model.correction_m(Vec2(x, 33), 2), 1e-4 * x, 1e-8);
}

TEST(DepthCorrection, MoreControlPointsThanPixels) {
  DepthCorrectionModel model = random_model(DepthFitMode::kSpline, 5, 4);
  model.columns = 23, model.rows = 19;
  Rng rng(4);
  model.coefficients.assign(static_cast<std::size_t>(3 * 23 * 19), 0.0F);
  for (float& c : model.coefficients) c = static_cast<float>(rng.uniform(-0.05, 0.05));
  DepthImage depth{Image<std::uint16_t>(5, 4, 2000), 1e-3};
  DepthCorrection(model, 5, 4).apply(depth);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 5; ++x)
      EXPECT_NEAR(depth.units(x, y), 2000 + 1000 * model.correction_m(Vec2(x, y), 2), 0.51);
}

TEST(DepthCorrection, ResultsStayReadings) {
  DepthCorrectionModel model = random_model(DepthFitMode::kSpline, 16, 12);
  const auto plane = static_cast<std::size_t>(model.columns * model.rows);
  std::fill(model.coefficients.begin(), model.coefficients.end(), 0.0F);
  std::fill_n(model.coefficients.begin(), plane, -50.0F);
  DepthImage depth = random_depth(16, 12, 3), up = depth;
  DepthCorrection(model, 16, 12).apply(depth);
  std::fill_n(model.coefficients.begin(), plane, 90.0F);
  DepthCorrection(model, 16, 12).apply(up);
  for (std::size_t i = 0; i < depth.units.size(); ++i) {
    EXPECT_LE(depth.units.data()[i], 1);
    EXPECT_TRUE(up.units.data()[i] == 0 || up.units.data()[i] == 65535) << up.units.data()[i];
    EXPECT_EQ(depth.units.data()[i] == 0, up.units.data()[i] == 0);
  }
}

TEST(DepthCorrection, WrongModelsAreRefused) {
  const DepthCorrectionModel good = random_model(DepthFitMode::kQuadraticZero, 20, 10);
  EXPECT_TRUE(check_model(good));
  const auto broken = [&](auto&& change) {
    DepthCorrectionModel model = good;
    change(model);
    return !check_model(model).has_value();
  };
  EXPECT_TRUE(broken([](auto& m) { m.width = 0; }));
  EXPECT_TRUE(broken([](auto& m) { m.terms = 5; }));
  EXPECT_TRUE(broken([](auto& m) { m.columns = 19; }));
  EXPECT_TRUE(broken([](auto& m) { m.max_depth_m = m.min_depth_m; }));
  EXPECT_TRUE(broken([](auto& m) { m.min_depth_m = std::nan(""); }));
  EXPECT_TRUE(broken([](auto& m) { m.coefficients.pop_back(); }));
  EXPECT_TRUE(broken([](auto& m) { m.coefficients[5] = std::nanf(""); }));
  EXPECT_TRUE(broken([](auto& m) { m.highest_s[7] = 1.5F; }));
  EXPECT_TRUE(broken([](auto& m) { m.lowest_s.clear(); }));
}

}  // namespace
}  // namespace hm
