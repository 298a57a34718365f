#include "hm/calibration/noise_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

TEST(NoiseFit, FindsThePolynomial) {
  const DepthNoise truth{0.0019, -0.00152, 0.001504};
  std::vector<NoiseSample> samples;
  for (double z = 0.5; z < 5; z += 0.1) samples.push_back({z, truth.sigma_m(z), 1000});
  const auto fit = fit_noise(samples);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->noise.quadratic_per_m, truth.quadratic_per_m, 1e-9);
  EXPECT_NEAR(fit->noise.linear_ratio, truth.linear_ratio, 1e-9);
  EXPECT_NEAR(fit->noise.constant_m, truth.constant_m, 1e-9);
}

TEST(NoiseFit, StaysAllowedWhereTheBestFitIsNot) {
  std::vector<NoiseSample> samples;  // concave: a free fit has a negative quadratic term
  for (double z = 0.5; z < 5; z += 0.1) samples.push_back({z, 0.002 * std::sqrt(z), 1000});
  const auto fit = fit_noise(samples);
  ASSERT_TRUE(fit);
  EXPECT_GE(fit->noise.quadratic_per_m, 0);
  EXPECT_GE(fit->noise.constant_m, 0);
  for (double z = 0.5; z < 5; z += 0.5) EXPECT_NEAR(fit->noise.sigma_m(z) / (0.002 * std::sqrt(z)), 1, 0.35);
  EXPECT_FALSE(fit_noise(std::vector<NoiseSample>(2, {1, 0.001, 10})));
}

/// A slope with noise k z^2: both ways of measuring find k, and missing readings change nothing.
TEST(NoiseHistogram, BothSourcesFindTheNoise) {
  constexpr double kQuadratic = 0.0015;
  const auto reading = [&](int x, Rng& rng) {
    const double z = 1 / (0.8 - 0.0018 * x);  // a plane: 1.25 m to 4.4 m
    const double noisy = z + rng.normal(0, kQuadratic * z * z);
    return static_cast<std::uint16_t>(std::lround(noisy * 5000));
  };
  Rng rng(1);
  DepthAverage average(320, 64);
  NoiseHistogram over_time, of_planes;
  for (int image = 0; image < 30; ++image) {
    DepthImage depth{Image<std::uint16_t>(320, 64), 1.0 / 5000};
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 320; ++x) depth.units(x, y) = reading(x, rng);
    of_planes.add_plane(depth);
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 320; ++x)
        if (rng.below(10) == 0) depth.units(x, y) = 0;
    average.add(depth);
  }
  over_time.add_static(average);
  for (const NoiseHistogram* histogram : {&over_time, &of_planes}) {
    const auto samples = histogram->samples();
    ASSERT_GT(samples.size(), 20u);
    const auto fit = fit_noise(samples);
    ASSERT_TRUE(fit);
    for (const double z : {1.3, 2.0, 3.0, 4.0})
      EXPECT_NEAR(fit->noise.sigma_m(z) / (kQuadratic * z * z), 1, 0.04) << z;
  }
}

}  // namespace
}  // namespace hm
