#include "hm/odometry/geometry_tracking/pose_velocity_filter.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include <Eigen/LU>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

constexpr double kStep_s = 1.0 / 30;

Vec6 draw_motion(Rng& rng, double scale) {
  Vec6 out;
  for (int i = 0; i < 6; ++i) out[i] = scale * rng.normal();
  return out;
}

TEST(PoseVelocityFilter, GoesOnAtConstantVelocityWithoutMeasurements) {
  Vec6 twist_s;
  twist_s << 0.3, -0.2, 0.1, 0.2, 0.4, -0.3;
  PoseVelocityFilter filter({}, twist_s);
  const auto ahead = filter.predict(0.2, {});
  EXPECT_LT((SE3::exp(0.2 * twist_s).inverse() * ahead.T_odom_camera).log().norm(), 1e-12);
  // Step by step or at once: the same covariance, but for the turn of the camera's axes.
  for (int i = 0; i < 6; ++i)
    filter.update(0.2 / 6, {}, filter.predict(0.2 / 6, {}).T_odom_camera, Mat6::Zero());
  EXPECT_LT((filter.covariance() - ahead.covariance).norm(), 0.05 * ahead.covariance.norm());
  EXPECT_LT((filter.twist_s() - twist_s).norm(), 1e-9);
}

/// Errors are as large as the covariance says: random accelerations, measurements of position and rotation
/// for which the estimate is the weighted mean.
TEST(PoseVelocityFilter, ErrorsAreAsLargeAsTheCovarianceSays) {
  constexpr double kSigma = 0.01, kSpectral_m = 0.5, kSpectral_rad = 2.0;
  const Mat6 information = Mat6::Identity() / (kSigma * kSigma);
  double sum = 0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Rng rng(seed);
    Vec6 twist_s = draw_motion(rng, 0.3);
    SE3 truth;
    PoseVelocityFilter filter({}, std::nullopt);
    for (int i = 0; i < 60; ++i) {
      Vec6 change = draw_motion(rng, std::sqrt(kStep_s));
      change.head<3>() *= kSpectral_m, change.tail<3>() *= kSpectral_rad;
      truth = truth * SE3::exp(kStep_s * (twist_s + 0.5 * change));
      twist_s += change;
      const SE3 seen = truth * SE3::exp(draw_motion(rng, kSigma));
      const auto predicted = filter.predict(kStep_s, {});
      const Mat6 prior = predicted.covariance.inverse();
      const Vec6 step =
          (prior + information).inverse() * information * (predicted.T_odom_camera.inverse() * seen).log();
      filter.update(kStep_s, {}, predicted.T_odom_camera * SE3::exp(step), information);
    }
    const Vec6 error = (filter.T_odom_camera().inverse() * truth).log();
    sum += error.dot(filter.covariance().inverse() * error);
    count += 6;
  }
  EXPECT_NEAR(sum / count, 1, 0.25);
}

TEST(PoseVelocityFilter, AGyroscopeReplacesThePredictedRotation) {
  PoseVelocityFilter filter({}, Vec6::Zero());
  const Mat3 turn = so3_exp(Vec3(0.05, -0.1, 0.02));
  const auto with = filter.predict(kStep_s, turn), without = filter.predict(kStep_s, {});
  EXPECT_LT((with.T_odom_camera.rotation() - turn).norm(), 1e-12);
  const auto rotation_rad2 = [](const PoseVelocityFilter::Prediction& p) {
    return p.covariance.diagonal().tail<3>().sum();
  };
  EXPECT_LT(rotation_rad2(with), rotation_rad2(without));
}

}  // namespace
}  // namespace hm
