#include "hm/odometry/registration/rigid_registration.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include <algorithm>
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/odometry/testing/point_scenes.hpp"

namespace hm {
namespace {

TEST(RegisterPoints, FindsAKnownMotionExactly) {
  Rng rng(1);
  for (int trial = 0; trial < 100; ++trial) {
    const SE3 truth = random_motion(rng, 3.0, 3.0);
    const auto found = register_points(exact_pairs(truth, 3 + static_cast<int>(rng.below(20)), rng));
    ASSERT_TRUE(found);
    EXPECT_LT((found->inverse() * truth).log().norm(), 1e-9);
    EXPECT_TRUE(is_rigid(*found));
  }
}

TEST(RegisterPoints, WeightsDecideBetweenTwoMotions) {
  Rng rng(2);
  const SE3 first = random_motion(rng, 1, 1), second = random_motion(rng, 1, 1);
  std::vector<PointPair> pairs = exact_pairs(first, 20, rng);
  const std::vector<PointPair> others = exact_pairs(second, 20, rng);
  pairs.insert(pairs.end(), others.begin(), others.end());
  std::vector<double> weights(40, 0.0);
  std::fill(weights.begin(), weights.begin() + 20, 2.0);
  EXPECT_LT((register_points(pairs, weights)->inverse() * first).log().norm(), 1e-9);
  std::reverse(weights.begin(), weights.end());
  EXPECT_LT((register_points(pairs, weights)->inverse() * second).log().norm(), 1e-9);
  EXPECT_GT((register_points(pairs)->inverse() * first).log().norm(), 1e-2);
}

TEST(RegisterPoints, APlaneOrAMirroredCloudDoesNotMirror) {
  Rng rng(3);
  const SE3 truth = random_motion(rng, 1, 1);
  std::vector<PointPair> pairs;
  for (int i = 0; i < 30; ++i) {
    const Vec3 p(rng.normal(), rng.normal(), 0);
    pairs.push_back({truth * p, p, Mat3::Zero(), Mat3::Zero()});
  }
  const auto found = register_points(pairs);
  ASSERT_TRUE(found);
  EXPECT_LT((found->inverse() * truth).log().norm(), 1e-9);
  for (PointPair& pair : pairs) {
    pair.p_b.z() = rng.normal();
    pair.p_a = Vec3(-pair.p_b.x(), pair.p_b.y(), pair.p_b.z());
  }
  EXPECT_NEAR(register_points(pairs)->rotation().determinant(), 1, 1e-12);
}

TEST(RegisterPoints, NothingFromTooFewOrALine) {
  Rng rng(4);
  const SE3 truth = random_motion(rng, 1, 1);
  std::vector<PointPair> pairs;
  for (int i = 0; i < 50; ++i) {
    const Vec3 p = Vec3(1, 2, 3) * rng.normal();
    pairs.push_back({truth * p, p, Mat3::Zero(), Mat3::Zero()});
  }
  EXPECT_FALSE(register_points(pairs));
  EXPECT_FALSE(register_points(std::vector<PointPair>(5)));  // all in one place
  EXPECT_FALSE(register_points(exact_pairs(truth, 2, rng)));
  EXPECT_FALSE(register_points({}));
}

TEST(RefineRegistration, JacobianAgreesWithDifferences) {
  Rng rng(5);
  for (int trial = 0; trial < 20; ++trial) {
    const SE3 T = random_motion(rng, 2, 3);
    const PointPair pair{Vec3(rng.normal(), rng.normal(), rng.normal()),
                         Vec3(rng.normal(), rng.normal(), rng.normal()), Mat3::Zero(), Mat3::Zero()};
    const auto jacobian = detail::residual_jacobian(pair, T);
    constexpr double kStep = 1e-6;
    for (int i = 0; i < 6; ++i) {
      Vec6 step = Vec6::Zero();
      step(i) = kStep;
      const Vec3 numeric =
          (pair.residual(SE3::exp(step) * T) - pair.residual(SE3::exp(-step) * T)) / (2 * kStep);
      EXPECT_LT((numeric - jacobian.col(i)).norm(), 1e-8);
    }
  }
}

TEST(RefineRegistration, BeatsTheClosedFormWherePointsDifferInCertainty) {
  double refined_error = 0, plain_error = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Rng rng(seed);
    const SE3 truth = random_motion(rng, 0.05, 0.05);
    const std::vector<PointPair> pairs = noisy_pairs(truth, 80, rng);
    const auto plain = register_points(pairs);
    const auto refined = refine_registration(pairs, *plain);
    ASSERT_TRUE(refined);
    refined_error += (refined->T_a_b.inverse() * truth).translation().norm();
    plain_error += (plain->inverse() * truth).translation().norm();
  }
  EXPECT_LT(refined_error, 0.7 * plain_error);
}

TEST(RefineRegistration, CovarianceIsConsistentOverSeeds) {
  double nees = 0, chi2 = 0;
  constexpr int kSeeds = 400;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    Rng rng(seed);
    const SE3 truth = random_motion(rng, 0.1, 0.1);
    const auto refined = refine_registration(noisy_pairs(truth, 60, rng), truth, 0);
    ASSERT_TRUE(refined);
    const Vec6 error = (refined->T_a_b * truth.inverse()).log();
    nees += error.dot(refined->covariance.inverse() * error);
    chi2 += refined->mean_chi2;
  }
  EXPECT_NEAR(nees / kSeeds, 6, 0.6);  // deviation of the mean: 0.17
  EXPECT_NEAR(chi2 / kSeeds, 3 * (1 - 6.0 / 180), 0.1);
}

TEST(RefineRegistration, NothingWhereTheMotionIsNotDetermined) {
  Rng rng(6);
  EXPECT_FALSE(refine_registration({}, {}));
  std::vector<PointPair> line;
  for (int i = 0; i < 20; ++i) {
    const Vec3 p(0, 0, rng.uniform(1, 3));
    line.push_back({p, p, 1e-4 * Mat3::Identity(), 1e-4 * Mat3::Identity()});
  }
  EXPECT_FALSE(refine_registration(line, {}));
}

}  // namespace
}  // namespace hm
