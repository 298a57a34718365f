#include "hm/geometry/float/float_math.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

TEST(FloatMath, SineAndCosineAgreeWithTheLibrary) {
  Rng rng(1);
  double worst = 0;
  for (int i = 0; i < 400000; ++i) {
    const double range = i < 100000 ? 4 : i < 200000 ? 100 : 8192;
    const auto x = static_cast<float>(rng.uniform(-range, range));
    const auto [sine, cosine] = sin_cos_f(x);
    const auto exact = static_cast<double>(x);
    worst = std::max({worst, std::abs(static_cast<double>(sine) - std::sin(exact)),
                      std::abs(static_cast<double>(cosine) - std::cos(exact))});
  }
  EXPECT_LT(worst, 1.2e-7);
  EXPECT_GT(worst, 1e-9) << "compared with itself?";
  EXPECT_EQ(sin_cos_f(0).sin, 0);
  EXPECT_EQ(sin_cos_f(0).cos, 1);
  for (const float x : {kNan, kInf, -kInf})
    EXPECT_TRUE(std::isnan(sin_cos_f(x).sin) && std::isnan(sin_cos_f(x).cos));
  for (const float x : {1e5F, 1e20F, std::numeric_limits<float>::max()}) {
    EXPECT_LE(std::abs(sin_cos_f(x).sin), 1);
    EXPECT_LE(std::abs(sin_cos_f(-x).cos), 1);
  }
}

TEST(FloatMath, ArcTangentAgreesWithTheLibraryInEveryQuadrant) {
  Rng rng(2);
  for (int i = 0; i < 200000; ++i) {
    const double scale = std::pow(10.0, rng.uniform(-6, 6));
    const auto y = static_cast<float>(rng.normal(0, scale)), x = static_cast<float>(rng.normal(0, 1));
    const double exact = std::atan2(static_cast<double>(y), static_cast<double>(x));
    ASSERT_NEAR(static_cast<double>(atan2_f(y, x)), exact, 4e-7 * std::abs(exact) + 1e-37) << y << " " << x;
  }
  EXPECT_EQ(atan2_f(0, 0), 0);
  EXPECT_EQ(atan2_f(0, -1), kPiF);
  EXPECT_FLOAT_EQ(atan2_f(1, 0), kPiF / 2);
  EXPECT_FLOAT_EQ(atan2_f(-kInf, kInf), -kPiF / 4);
  EXPECT_FLOAT_EQ(atan2_f(1, -kInf), kPiF);
  EXPECT_TRUE(std::isnan(atan2_f(kNan, 1)) && std::isnan(atan2_f(1, kNan)));
}

TEST(FloatMath, ArcSineExponentialAndLogarithmAgreeWithTheLibrary) {
  Rng rng(3);
  for (int i = 0; i < 100000; ++i) {
    const auto s = static_cast<float>(rng.uniform(-1, 1));
    ASSERT_NEAR(static_cast<double>(asin_f(s)), std::asin(static_cast<double>(s)), 4e-7);
    const auto x = static_cast<float>(rng.uniform(-87, 88));
    const double power = std::exp(static_cast<double>(x));
    ASSERT_NEAR(static_cast<double>(exp_f(x)) / power, 1, 2e-7) << x;
    const float positive = exp_f(x);
    const double logarithm = std::log(static_cast<double>(positive));
    ASSERT_NEAR(static_cast<double>(log_f(positive)), logarithm, 1e-7 + 1.2e-7 * std::abs(logarithm));
  }
  EXPECT_FLOAT_EQ(asin_f(2), kPiF / 2);
  EXPECT_FLOAT_EQ(asin_f(-2), -kPiF / 2);
  EXPECT_EQ(exp_f(0), 1);
  EXPECT_EQ(log_f(1), 0);
  EXPECT_GT(exp_f(1000), 1e38F);
  EXPECT_TRUE(std::isnan(log_f(0)) && std::isnan(log_f(-1)) && std::isnan(exp_f(kNan)) &&
              std::isnan(asin_f(kNan)));
}

TEST(FloatMath, AnglesAreWrapped) {
  Rng rng(4);
  for (int i = 0; i < 100000; ++i) {
    const auto angle = static_cast<float>(rng.uniform(-8000, 8000));
    const float wrapped = wrap_angle_f(angle);
    ASSERT_LE(std::abs(wrapped), kPiF);
    const double apart =
        std::remainder(static_cast<double>(angle) - static_cast<double>(wrapped), 2 * std::numbers::pi);
    ASSERT_NEAR(apart, 0, 4e-7) << angle;
  }
  EXPECT_EQ(wrap_angle_f(1.5F), 1.5F);
  EXPECT_LE(std::abs(wrap_angle_f(1e30F)), kPiF * 1.001F);
  EXPECT_TRUE(std::isnan(wrap_angle_f(kInf)));
}

TEST(FloatMath, ClampNeverLetsNoNumberThrough) {
  EXPECT_EQ(clamp_f(kNan, -1, 2), -1);
  EXPECT_EQ(clamp_f(5, -1, 2), 2);
  EXPECT_EQ(clamp_f(1, -1, 2), 1);
  EXPECT_EQ(clamp_f(5, 3, 2), 3) << "an empty interval";
}

TEST(FloatMath, TheBitsAreThoseOfEveryProcessor) {
  // Of a build for x86-64 at -O0, -O3 and with FMA instructions; a firmware compares its own with this.
  std::uint64_t hash = 1469598103934665603U;
  const auto add = [&hash](float value) {
    hash = (hash ^ std::bit_cast<std::uint32_t>(value)) * 1099511628211U;
  };
  for (int i = -5000; i < 5000; ++i) {
    const float x = static_cast<float>(i) * 0.01732F;
    const auto [sine, cosine] = sin_cos_f(x);
    add(sine);
    add(cosine);
    add(atan2_f(x, 3.3F - x));
    add(asin_f(sine));
    add(exp_f(x));
    add(log_f(x * x + 0.01F));
    add(wrap_angle_f(100 * x));
  }
  EXPECT_EQ(hash, 0x0dc255aaa177dfe8U) << std::hex << hash;
}

}  // namespace
}  // namespace hm
