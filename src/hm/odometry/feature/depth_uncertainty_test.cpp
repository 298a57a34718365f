#include "hm/odometry/feature/depth_uncertainty.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

constexpr DepthNoise kPublishedNoise{0.001425, 0, 0};

DepthImage depth_of(int width, int height, std::uint16_t unit) {
  DepthImage depth;
  depth.units = Image<std::uint16_t>(width, height, unit);
  return depth;
}

TEST(QuadraticDepth, DeviationIsThatOfTheSensorAtThisDepth) {
  const auto at = quadratic_depth(depth_of(3, 3, 2000), 1, 1, kPublishedNoise);
  ASSERT_TRUE(at);
  EXPECT_DOUBLE_EQ(at->mean_m, 2.0);
  EXPECT_NEAR(std::sqrt(at->variance_m2), 0.0057, 1e-12);
}

TEST(MixtureDepth, OnAPlaneFacingTheCameraItIsTheQuadraticModel) {
  const DepthImage depth = depth_of(5, 5, 3000);
  const auto mixture = mixture_depth(depth, 2, 2, kPublishedNoise);
  const auto quadratic = quadratic_depth(depth, 2, 2, kPublishedNoise);
  ASSERT_TRUE(mixture && quadratic);
  EXPECT_NEAR(mixture->mean_m, quadratic->mean_m, 1e-12);
  EXPECT_NEAR(mixture->variance_m2, quadratic->variance_m2, 1e-15);
}

TEST(MixtureDepth, AnEdgeGetsTheVarianceOfItsTwoSides) {
  DepthImage depth = depth_of(3, 3, 1000);
  for (int y = 0; y < 3; ++y) depth.units(2, y) = 2000;
  // 1 m has weight 4 + 3*2 + 2*1 = 12, 2 m has 2 + 2*1 = 4.
  const auto at = mixture_depth(depth, 1, 1, kPublishedNoise);
  ASSERT_TRUE(at);
  EXPECT_NEAR(at->mean_m, 1.25, 1e-12);
  const double within = (12 * std::pow(0.001425, 2) + 4 * std::pow(0.0057, 2)) / 16;
  const double between = 0.75 * 0.0625 + 0.25 * 0.5625;
  EXPECT_NEAR(at->variance_m2, within + between, 1e-12);
}

TEST(MixtureDepth, WeightsAreByDistanceFromTheCentre) {
  DepthImage depth = depth_of(3, 3, 0);
  depth.units(1, 1) = 1000;
  depth.units(1, 0) = 1100;
  depth.units(0, 0) = 1300;
  const auto at = mixture_depth(depth, 1, 1, kPublishedNoise, {4, 2, 1});
  ASSERT_TRUE(at);
  EXPECT_NEAR(at->mean_m, (4 * 1.0 + 2 * 1.1 + 1.3) / 7, 1e-12);
}

TEST(MixtureDepth, InvalidReadingsDoNotCountAndTheCentreMustBeValid) {
  DepthImage depth = depth_of(3, 3, 0);
  EXPECT_FALSE(mixture_depth(depth, 1, 1, kPublishedNoise));
  depth.units(0, 1) = 1500;
  EXPECT_FALSE(mixture_depth(depth, 1, 1, kPublishedNoise));
  EXPECT_TRUE(mixture_depth(depth, 0, 1, kPublishedNoise));
  EXPECT_NEAR(mixture_depth(depth, 0, 1, kPublishedNoise)->mean_m, 1.5, 1e-12);
}

TEST(MixtureDepth, TheWindowEndsAtTheBorder) {
  const DepthImage depth = depth_of(4, 3, 1700);
  for (int y = -1; y <= 3; ++y) {
    for (int x = -1; x <= 4; ++x) {
      const bool inside = depth.units.contains(x, y);
      const auto at = mixture_depth(depth, x, y, kPublishedNoise);
      ASSERT_EQ(at.has_value(), inside) << x << " " << y;
      EXPECT_NEAR(at ? at->mean_m : 1.7, 1.7, 1e-12);
    }
  }
  EXPECT_FALSE(quadratic_depth(depth, 4, 0, kPublishedNoise));
}

TEST(MixtureDepth, FineUnitsFarAwayDoNotCancel) {
  // z^2 is 36 m^2, the variance 1e-8 m^2: sum(z^2) - mean^2 would be noise.
  DepthImage depth = depth_of(3, 3, 60000);
  depth.unit_m = 1e-4;
  const auto at = mixture_depth(depth, 1, 1, DepthNoise{0, 0, 1e-4});
  ASSERT_TRUE(at);
  EXPECT_NEAR(at->variance_m2, 1e-8, 1e-16);
}

TEST(CorrectedMixture, OnANoisyPlaneTheDeviationIsTheSensors) {
  const DepthNoise noise{0, 0, 0.01};
  double published = 0, corrected = 0;
  constexpr int kTrials = 3000;
  for (int trial = 0; trial < kTrials; ++trial) {
    Rng rng(static_cast<std::uint64_t>(trial));
    DepthImage depth = depth_of(3, 3, 0);
    for (auto& unit : depth.units.pixels())
      unit = static_cast<std::uint16_t>(std::lround(rng.normal(2000, 10)));
    published += mixture_depth(depth, 1, 1, noise)->variance_m2 / kTrials;
    corrected += corrected_mixture_depth(depth, 1, 1, noise)->variance_m2 / kTrials;
  }
  EXPECT_NEAR(published, 1e-4 * (2 - 36.0 / 256), 2e-6);  // the noise twice, less the mean's
  EXPECT_LT(corrected, 1.25e-4);
  EXPECT_GE(corrected, 1e-4);
}

/// Errors of the window's mean, which odometry uses, in stated deviations, over seeds. As far as the readings
/// have errors in common (real sensors), they are as large as stated; independent ones (simulation) average
/// out, to sqrt(36) / 16 of a reading's. They are never larger than stated.
TEST(CorrectedMixture, ItsMeanErrsNoMoreThanStated) {
  const DepthNoise noise{0, 0, 0.01};
  for (const double shared_ratio : {0.0, 0.5, 1.0}) {  // of the variance
    double of_mean = 0, of_reading = 0;
    constexpr int kTrials = 4000;
    for (int trial = 0; trial < kTrials; ++trial) {
      Rng rng(static_cast<std::uint64_t>(trial));
      const double shared = rng.normal(2000, 10 * std::sqrt(shared_ratio));
      DepthImage depth = depth_of(3, 3, 0);
      for (auto& unit : depth.units.pixels())
        unit =
            static_cast<std::uint16_t>(std::lround(shared + rng.normal(0, 10 * std::sqrt(1 - shared_ratio))));
      const auto at = corrected_mixture_depth(depth, 1, 1, noise);
      of_mean += (at->mean_m - 2) * (at->mean_m - 2) / at->variance_m2 / kTrials;
      of_reading += std::pow(depth.depth_m(1, 1) - 2, 2) / at->variance_m2 / kTrials;
    }
    EXPECT_NEAR(std::sqrt(of_mean), std::sqrt(shared_ratio + (1 - shared_ratio) * 36.0 / 256), 0.07)
        << shared_ratio;
    EXPECT_GT(std::sqrt(of_reading), 0.8) << shared_ratio;
    EXPECT_LT(std::sqrt(of_reading), 1.3) << shared_ratio;
  }
}

TEST(CorrectedMixture, AtAnEdgeItIsThePublishedOne) {
  DepthImage depth = depth_of(3, 3, 1000);
  for (int y = 0; y < 3; ++y) depth.units(2, y) = 2000;
  const auto published = mixture_depth(depth, 1, 1, kPublishedNoise);
  const auto corrected = corrected_mixture_depth(depth, 1, 1, kPublishedNoise);
  ASSERT_TRUE(published && corrected);
  EXPECT_EQ(corrected->mean_m, published->mean_m);
  EXPECT_NEAR(corrected->variance_m2, published->variance_m2, 1e-4 * published->variance_m2);
  EXPECT_FALSE(corrected_mixture_depth(depth_of(3, 3, 0), 1, 1, kPublishedNoise));
}

/// Points with random pixel and depth errors agree with their predicted covariance.
TEST(FeatureCovariance, AgreesWithSampledPoints) {
  for (const double fy : {525.0, -480.0}) {
    const PinholeCamera camera{640, 480, 525, fy, 319.5, 239.5, {}};
    const Vec2 pixel(520, 90);
    const DepthGaussian depth{2.5, 0.04 * 0.04};
    Rng rng(7);
    constexpr int kCount = 200000;
    Vec3 sum = Vec3::Zero();
    Mat3 squares = Mat3::Zero();
    const Vec3 mean = camera.unproject(pixel, depth.mean_m);
    for (int i = 0; i < kCount; ++i) {
      const Vec2 at(rng.normal(pixel.x(), 1.5), rng.normal(pixel.y(), 1.5));
      const Vec3 error = camera.unproject(at, rng.normal(depth.mean_m, 0.04)) - mean;
      sum += error;
      squares += error * error.transpose();
    }
    const Mat3 sampled = squares / kCount - (sum / kCount) * (sum / kCount).transpose();
    const Mat3 predicted = feature_covariance(camera, pixel, depth, 1.5);
    EXPECT_LT((sampled - predicted).norm(), 0.02 * predicted.norm()) << sampled << "\n" << predicted;
    EXPECT_NEAR(predicted(2, 2), depth.variance_m2, 1e-15);
    EXPECT_LT((predicted - predicted.transpose()).norm(), 1e-18);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Mat3>(predicted).eigenvalues().minCoeff(), 0);
  }
}

TEST(FeatureCovariance, NormalisedErrorsAreChiSquaredOverSeeds) {
  const PinholeCamera camera{640, 480, 525, 525, 319.5, 239.5, {}};
  double sum = 0;
  constexpr int kSeeds = 4000;
  for (int seed = 0; seed < kSeeds; ++seed) {
    Rng rng(static_cast<std::uint64_t>(seed));
    const Vec2 pixel(rng.uniform(20, 620), rng.uniform(20, 460));
    const double z = rng.uniform(0.8, 4.5);
    const double sigma = kPublishedNoise.sigma_m(z);
    const DepthGaussian depth{z, sigma * sigma};
    const Vec2 seen = pixel + Vec2(rng.normal(), rng.normal());
    const Vec3 error = camera.unproject(seen, rng.normal(z, sigma)) - camera.unproject(pixel, z);
    sum += error.dot(feature_covariance(camera, pixel, depth).inverse() * error);
  }
  EXPECT_NEAR(sum / kSeeds, 3.0, 0.15);  // three degrees of freedom, deviation of the mean 0.04
}

}  // namespace
}  // namespace hm
