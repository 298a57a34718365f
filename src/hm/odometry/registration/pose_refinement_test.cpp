#include "hm/odometry/registration/pose_refinement.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "hm/core/rng.hpp"
#include "hm/odometry/testing/point_scenes.hpp"
#include "hm/odometry/tracker/tracker_registration.hpp"

namespace hm {
namespace {

const PinholeCamera kMirroredCamera{640, 480, 525, -520, 319.5, 239.5, {}};  // mirrored, as ICL-NUIM has it

PointObservation observe(const Vec3& p_odom, const SE3& T_odom_camera, bool depth) {
  PointObservation out;
  out.p_odom = p_odom;
  out.covariance = Vec3(1e-4, 4e-4, 2e-4).asDiagonal();
  const Vec3 p = T_odom_camera.inverse() * p_odom;
  out.pixel = kMirroredCamera.project(p);
  out.pixel_covariance << 0.2, 0.05, 0.05, 0.1;
  if (depth) out.depth_m = p.z(), out.depth_variance_m2 = 1e-4;
  return out;
}

TEST(PoseRefinement, JacobiansAreTheNumericOnes) {
  Rng rng(1);
  for (int trial = 0; trial < 50; ++trial) {
    const SE3 T = random_motion(rng, 1, 0.6);
    PointObservation observation = observe(T * point_in_view(rng), T, trial % 2 == 0);
    observation.pixel += Vec2(1.5, -0.7);
    const auto residual = point_residual(observation, T, kMirroredCamera);
    ASSERT_TRUE(residual);
    constexpr double h = 1e-6;
    for (int i = 0; i < 6; ++i) {
      const Vec6 step = h * Vec6::Unit(i);
      const Vec3 numeric = (point_residual(observation, T * SE3::exp(step), kMirroredCamera)->value -
                            point_residual(observation, T * SE3::exp(-step), kMirroredCamera)->value) /
                           (2 * h);
      EXPECT_LT((numeric - residual->by_pose.col(i)).norm(), 1e-4 * (1 + numeric.norm())) << i;
    }
    for (int i = 0; i < 3; ++i) {
      PointObservation plus = observation, minus = observation;
      plus.p_odom[i] += h, minus.p_odom[i] -= h;
      const Vec3 numeric = (point_residual(plus, T, kMirroredCamera)->value -
                            point_residual(minus, T, kMirroredCamera)->value) /
                           (2 * h);
      EXPECT_LT((numeric - residual->by_point.col(i)).norm(), 1e-4 * (1 + numeric.norm())) << i;
    }
  }
}

TEST(PoseRefinement, WithoutDepthOnlyThePixelCounts) {
  Rng rng(2);
  const SE3 T = random_motion(rng, 1, 0.5);
  const auto residual = point_residual(observe(T * Vec3(0.2, 0.1, 2), T, false), T, kMirroredCamera);
  EXPECT_EQ(residual->value.z(), 0);
  EXPECT_EQ(residual->information(2, 2), 0);
  EXPECT_FALSE(point_residual(observe(T * Vec3(0.2, 0.1, 2), T, false),
                              T * SE3(Mat3::Identity(), Vec3(0, 0, 3)), kMirroredCamera));
}

TEST(PoseRefinement, FindsTheMotionAmongSixtyPercentOutliers) {
  Rng rng(3);
  const SE3 truth = random_motion(rng, 1, 0.5);
  std::vector<PointObservation> observations;
  for (int i = 0; i < 200; ++i) {
    observations.push_back(observe(truth * point_in_view(rng), truth, i % 3 != 0));
    if (i % 5 < 3) {
      const double dx = rng.uniform(-60, 60);
      observations.back().pixel += Vec2(dx, rng.uniform(-60, 60));
    }
  }
  SE3 T = truth * SE3::exp((Vec6() << 0.01, -0.01, 0.02, 0.004, -0.004, 0.003).finished());
  for (int i = 0; i < 30; ++i) {
    const PoseEquations equations = point_equations(observations, T, kMirroredCamera);
    T = T * SE3::exp(-equations.information.ldlt().solve(equations.gradient));
  }
  EXPECT_LT((T.inverse() * truth).log().norm(), 0.01);  // the influence of outliers is bounded
}

TEST(PoseRefinement, TheVarianceScaleIsThatOfTheResiduals) {
  Rng rng(4);
  for (const double factor : {1.0, 3.0}) {
    std::vector<PointObservation> observations;
    for (int i = 0; i < 4000; ++i) {
      PointObservation o = observe(point_in_view(rng), {}, false);
      o.covariance.setZero();
      o.pixel_covariance = Mat2::Identity() * 0.25;
      const double dx = rng.normal(0, 0.5 * factor);
      o.pixel += Vec2(dx, rng.normal(0, 0.5 * factor));
      observations.push_back(o);
    }
    EXPECT_NEAR(residual_variance_scale(observations, {}, kMirroredCamera), factor * factor,
                0.1 * factor * factor);
  }
  EXPECT_EQ(residual_variance_scale({}, {}, kMirroredCamera), 1);
}

TEST(PoseRefinement, GravityJacobianIsTheNumericOne) {
  Rng rng(5);
  const SE3 T = random_motion(rng, 1, 0.8);
  const UpPrior up{Vec3(0.1, -1, 0.2).normalized(), Vec3(0.05, -0.98, 0.1).normalized()};
  const PoseEquations equations = up_equations(up, T);
  for (int i = 0; i < 6; ++i) {
    const Vec6 step = 1e-6 * Vec6::Unit(i);
    const double numeric =
        (up_equations(up, T * SE3::exp(step)).cost - up_equations(up, T * SE3::exp(-step)).cost) / 2e-6;
    EXPECT_NEAR(equations.gradient[i], numeric, 1e-3 * (1 + std::abs(numeric))) << i;
  }
}

TEST(PoseRefinement, AdjointMovesAPerturbationToTheLeft) {
  Rng rng(6);
  const SE3 T = random_motion(rng, 2, 1);
  const Vec6 x = (Vec6() << 0.1, -0.2, 0.3, 0.2, 0.1, -0.3).finished();
  EXPECT_LT(((T * SE3::exp(x)).matrix() - (SE3::exp(adjoint(T) * x) * T).matrix()).norm(), 1e-12);
}

}  // namespace
}  // namespace hm
