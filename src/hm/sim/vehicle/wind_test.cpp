#include "hm/sim/vehicle/wind.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

namespace hm {
namespace {

WindParams without_gusts() {
  WindParams params;
  params.gust_m_s = 0;
  return params;
}

TEST(Wind, TurbulenceHasItsVarianceAndSpectrum) {
  const WindParams params = without_gusts();
  constexpr double kStep_s = 0.02, kSegment_s = 60;
  constexpr int kSegments = 300, kSteps = static_cast<int>(kSegment_s / kStep_s);
  const std::vector<int> harmonics = {2, 6, 15, 40};
  std::vector<double> power(harmonics.size(), 0);
  double square = 0;
  WindModel wind(params, 3);
  for (int segment = 0; segment < kSegments; ++segment) {
    std::vector<Vec3> v;
    for (int i = 0; i < kSteps; ++i, wind.step(kStep_s)) v.push_back(wind.velocity_world_m_s());
    for (const Vec3& sample : v) square += sample.squaredNorm() / 3;
    for (std::size_t h = 0; h < harmonics.size(); ++h)
      for (int axis = 0; axis < 3; ++axis) {
        std::complex<double> sum = 0;
        for (int i = 0; i < kSteps; ++i)
          sum += v[static_cast<std::size_t>(i)][axis] *
                 std::polar(1.0, -2 * std::numbers::pi * harmonics[h] * i / kSteps);
        power[h] += std::norm(sum) * kStep_s * kStep_s / kSegment_s / 3;
      }
  }
  const double s = params.turbulence_m_s, t = params.kTurbulenceCorrelation_s;
  EXPECT_NEAR(square / (kSegments * kSteps), s * s, 0.06 * s * s);
  for (std::size_t h = 0; h < harmonics.size(); ++h) {
    const double wt = 2 * std::numbers::pi * harmonics[h] / kSegment_s * t;
    const double expected = 2 * s * s * t / (1 + wt * wt);
    EXPECT_NEAR(power[h] / kSegments / expected, 1, 0.15) << harmonics[h];
  }
}

TEST(Wind, GustsHaveTheirShapeAndPeriod) {
  WindParams params;
  params.turbulence_m_s = 0;
  WindModel wind(params, 1);
  std::vector<double> speed;
  std::vector<Vec3> peaks;
  for (int i = 0; i < 60'000; ++i, wind.step(1e-3)) {
    speed.push_back(wind.velocity_world_m_s().norm());
    if (i % 20'000 == 11'000) peaks.push_back(wind.velocity_world_m_s());
  }
  EXPECT_EQ(speed[9'900], 0);
  EXPECT_EQ(speed[12'100], 0);
  for (const std::size_t ms : {10'300, 10'500, 11'000, 11'700, 30'500, 51'000}) {
    const double t = static_cast<double>(ms % 20'000) / 1000 - 10;
    EXPECT_NEAR(speed[ms], 0.75 * (1 - std::cos(std::numbers::pi * t)), 1e-6) << ms;
  }
  ASSERT_EQ(peaks.size(), 3U);
  EXPECT_GT((peaks[0] - peaks[1]).norm(), 0.01);  // from different directions
  EXPECT_EQ(peaks[0].z(), 0);
}

TEST(Wind, FaultGustAddsItsPeakOverItsDuration) {
  WindParams params = without_gusts();
  params.turbulence_m_s = 0;
  WindModel wind(params, 1);
  wind.begin_gust(3);
  double peak = 0;
  for (int i = 0; i < 3'000; ++i, wind.step(1e-3)) peak = std::max(peak, wind.velocity_world_m_s().norm());
  EXPECT_NEAR(peak, WindParams::kFaultGust_m_s, 1e-4);
  wind.step(1e-3);
  EXPECT_EQ(wind.velocity_world_m_s().norm(), 0);
}

}  // namespace
}  // namespace hm
