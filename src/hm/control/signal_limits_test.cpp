#include "hm/control/signal_limits.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace hm {
namespace {

TEST(SlewLimiter, FollowsByAtMostItsRate) {
  SlewLimiter limiter;
  limiter.start_from(1);
  for (int i = 1; i <= 100; ++i)
    ASSERT_NEAR(limiter.step(3, 10, 0.001F), 1 + 0.01F * static_cast<float>(i), 1e-5F);
  EXPECT_EQ(limiter.step(2.001F, 10, 0.001F), 2.001F) << "what is within reach is reached exactly";
  EXPECT_NEAR(limiter.step(-5, 10, 0.001F), 1.991F, 1e-6F);
}

/// Amplitude of a sine of this frequency behind the filter.
double gain_at(double frequency_hz, float cutoff_hz) {
  LowPass filter(cutoff_hz, 0.001F);
  double most = 0;
  for (int i = 0; i < 4000; ++i) {
    const double input = std::sin(2 * std::numbers::pi * frequency_hz * i * 1e-3);
    const double output = filter.step(Vec3f(static_cast<float>(input), 0, 0)).x();
    if (i > 2000) most = std::max(most, std::abs(output));
  }
  return most;
}

TEST(LowPass, HasTheResponseOfASecondOrderButterworthFilter) {
  // |H|^2 = 1 / (1 + (tan(pi f dt) / tan(pi fc dt))^4) after the bilinear transform
  for (const double f : {3.0, 20.0, 40.0, 93.0, 186.0}) {
    const double ratio = std::tan(std::numbers::pi * f * 1e-3) / std::tan(std::numbers::pi * 40e-3);
    EXPECT_NEAR(gain_at(f, 40), 1 / std::sqrt(1 + std::pow(ratio, 4)), 0.01) << f;
  }
  EXPECT_NEAR(gain_at(93, 1000), 1, 0.02) << "a cut-off beyond the sampling rate filters nothing";
}

TEST(LowPass, StartsFromItsFirstSample) {
  LowPass filter(40, 0.001F);
  for (int i = 0; i < 100; ++i) ASSERT_LT((filter.step(Vec3f(1, -2, 3)) - Vec3f(1, -2, 3)).norm(), 1e-5F);
  filter.reset();
  EXPECT_EQ(filter.step(Vec3f(7, 0, 0)), Vec3f(7, 0, 0));
}

}  // namespace
}  // namespace hm
