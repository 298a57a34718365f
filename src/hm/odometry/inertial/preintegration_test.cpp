#include "hm/odometry/inertial/preintegration.hpp"

#include <gtest/gtest.h>

#include "hm/odometry/testing/carried_device.hpp"

namespace hm {
namespace {

const Time kBegin = Time::from_seconds(2.003), kEnd = Time::from_seconds(2.403);
const CarriedErrors kIntegratedErrors{Vec3(0.01, -0.02, 0.015), Vec3(0.1, 0.05, -0.2)};
const ImuBias kBias{kIntegratedErrors.gyro_bias_rad_s, kIntegratedErrors.accel_bias_m_s2};

Preintegration integrated(std::span<const ImuSample> readings, const ImuBias& bias, double delay_s = 0) {
  const auto sum = preintegrate(readings, kBegin, kEnd, delay_s, bias, {});
  EXPECT_TRUE(sum);
  return sum.value_or(Preintegration{});
}

Vec9 difference(const Preintegration& a, const Preintegration& b) {
  Vec9 out;
  out << so3_log(b.dR.transpose() * a.dR), a.dv - b.dv, a.dp - b.dp;
  return out;
}

/// At 200 Hz against a hundred times as many readings, and against the path itself.
TEST(Preintegration, IsThatOfFineSteps) {
  const auto readings = carried_readings(1.9, 2.6, 200, kIntegratedErrors);
  const auto fine = carried_readings(1.9, 2.6, 20000, kIntegratedErrors);
  const Preintegration coarse = integrated(readings, kBias), exact = integrated(fine, kBias);
  const Vec9 apart = difference(coarse, exact);
  EXPECT_LT(apart.head<3>().norm(), 2e-6);
  EXPECT_LT(apart.segment<3>(3).norm(), 2e-5);
  EXPECT_LT(apart.tail<3>().norm(), 5e-6);

  const double a = kBegin.seconds(), b = kEnd.seconds(), dt = b - a;
  const Mat3 back = CarriedPath::pose(a).rotation().transpose();
  const Vec3 g(0, 0, -kGravity_m_s2), v = CarriedPath::velocity_m_s(a);
  EXPECT_NEAR(exact.duration_s, dt, 1e-9);
  EXPECT_LT((exact.dR - back * CarriedPath::pose(b).rotation()).norm(), 1e-6);
  EXPECT_LT((exact.dv - back * (CarriedPath::velocity_m_s(b) - v - g * dt)).norm(), 1e-6);
  const Vec3 path = CarriedPath::pose(b).translation() - CarriedPath::pose(a).translation();
  EXPECT_LT((exact.dp - back * (path - v * dt - 0.5 * dt * dt * g)).norm(), 1e-6);
}

TEST(Preintegration, DerivativesByTheBiasesAreTheNumericalOnes) {
  const auto readings = carried_readings(1.9, 2.6, 200, kIntegratedErrors);
  const Preintegration sum = integrated(readings, kBias);
  constexpr double kStep = 1e-5;
  for (int axis = 0; axis < 3; ++axis) {
    ImuBias more = kBias, less = kBias;
    more.gyro_rad_s[axis] += kStep, less.gyro_rad_s[axis] -= kStep;
    const Vec9 by_gyro = difference(integrated(readings, more), integrated(readings, less)) / (2 * kStep);
    EXPECT_LT((by_gyro.head<3>() - sum.R_by_gyro.col(axis)).norm(), 1e-6);
    EXPECT_LT((by_gyro.segment<3>(3) - sum.v_by_gyro.col(axis)).norm(), 1e-5);
    EXPECT_LT((by_gyro.tail<3>() - sum.p_by_gyro.col(axis)).norm(), 1e-5);
    more = less = kBias;
    more.accel_m_s2[axis] += kStep, less.accel_m_s2[axis] -= kStep;
    const Vec9 by_accel = difference(integrated(readings, more), integrated(readings, less)) / (2 * kStep);
    EXPECT_LT(by_accel.head<3>().norm(), 1e-12);
    EXPECT_LT((by_accel.segment<3>(3) - sum.v_by_accel.col(axis)).norm(), 1e-8);
    EXPECT_LT((by_accel.tail<3>() - sum.p_by_accel.col(axis)).norm(), 1e-8);
  }
}

TEST(Preintegration, DerivativeByTheDelayIsTheNumericalOne) {
  const auto readings = carried_readings(1.9, 2.6, 200, kIntegratedErrors);
  constexpr double kStep_s = 1e-4;
  const Vec9 numerical =
      difference(integrated(readings, kBias, kStep_s), integrated(readings, kBias, -kStep_s)) / (2 * kStep_s);
  const Vec9 analytical = integrated(readings, kBias).by_delay;
  EXPECT_GT(numerical.norm(), 0.5);
  EXPECT_LT((numerical - analytical).norm(), 0.01 * numerical.norm());
}

/// The stamps of readings that are late give the same motion, once that is known.
TEST(Preintegration, KnowsThatStampsAreLate) {
  CarriedErrors late = kIntegratedErrors;
  late.delay_s = 0.0123;
  const Preintegration sum = integrated(carried_readings(1.9, 2.6, 200, late), kBias, late.delay_s);
  const Preintegration prompt = integrated(carried_readings(1.9, 2.6, 200, kIntegratedErrors), kBias);
  EXPECT_LT(difference(sum, prompt).norm(), 1e-8);
}

/// Errors over 400 runs with noise, against the covariance: chi-squared with nine degrees of freedom.
TEST(Preintegration, CovarianceIsThatOfItsErrors) {
  CarriedErrors noisy = kIntegratedErrors;
  const ImuNoise noise;
  noisy.gyro_density = noise.gyro_rad_s_sqrt_hz;
  noisy.accel_density = noise.accel_m_s2_sqrt_hz;
  const Preintegration exact = integrated(carried_readings(1.9, 2.6, 200, kIntegratedErrors), kBias);
  Rng rng(5);
  double sum = 0;
  constexpr int kRuns = 400;
  for (int run = 0; run < kRuns; ++run) {
    const Preintegration seen = integrated(carried_readings(1.9, 2.6, 200, noisy, &rng), kBias);
    const Vec9 error = difference(seen, exact);
    sum += error.dot(Mat9(exact.covariance.inverse()) * error) / kRuns;
  }
  EXPECT_NEAR(sum, 9, 0.9);
}

TEST(Preintegration, NeedsReadingsWithoutGaps) {
  const auto readings = carried_readings(1.9, 2.6, 200, kIntegratedErrors);
  const auto sum_of = [](std::span<const ImuSample> some) {
    return preintegrate(some, kBegin, kEnd, 0, {}, {}).has_value();
  };
  EXPECT_TRUE(sum_of(readings));
  EXPECT_FALSE(sum_of({}));
  EXPECT_FALSE(sum_of(std::span(readings).first(60)));    // until 2.2 s
  EXPECT_FALSE(sum_of(std::span(readings).subspan(60)));  // from 2.2 s
  EXPECT_FALSE(preintegrate(readings, kEnd, kBegin, 0, {}, {}));
  auto gap = readings;
  gap.erase(gap.begin() + 40, gap.begin() + 65);
  EXPECT_FALSE(sum_of(gap));
}

}  // namespace
}  // namespace hm
