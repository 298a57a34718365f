#include "hm/tsdf/alignment/trajectory_aligner.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "hm/core/rng.hpp"
#include "hm/tsdf/alignment/alignment_step.hpp"
#include "hm/tsdf/testing/integration_bench.hpp"

namespace hm {
namespace {

/// Walls, floor and two balls: every direction is observable.
const AnalyticScene kFollowedCorner{{{Vec3(-1, 0, 0), -2.0}, {Vec3(0, -1, 0), -0.7}, {Vec3(0, 0, 1), -0.6}},
                                    {{Vec3(1.5, -0.3, 0.1), 0.3}}};
constexpr int kFrames = 40;

/// Camera moving sideways.
SE3 truth_at(int i) { return looking_along_x(Vec3(0.003 * i, 0.006 * i - 0.1, 0.02 * std::sin(0.2 * i))); }

/// Independent errors of a pose at `camera`, as covariance of a left perturbation in odom.
Mat6 covariance_at(const Vec3& camera, double sigma_m, double sigma_rad) {
  Vec6 variances;
  variances << Vec3::Constant(sigma_m * sigma_m), Vec3::Constant(sigma_rad * sigma_rad);
  const Mat6 to_origin = TurningCentre{camera, 1}.to_origin();
  return to_origin * variances.asDiagonal() * to_origin.transpose();
}

/// Walk with depth images too large by `scale`, and odometry that drifts by `drift_m` per frame.
struct Walk {
  double scale = 1, drift_m = 0, stated_m_per_frame = 0;
  bool states_covariance = true;

  /// Error of the last pose in metres.
  [[nodiscard]] double error_m() const {
    IntegrationBench bench({});
    TrajectoryAligner aligner({}, bench.params, {}, kCamera);
    SE3 aligned, T_odom_camera;
    for (int i = 0; i < kFrames; ++i) {
      T_odom_camera = {truth_at(i).rotation(), truth_at(i).translation() + drift_m * i * Vec3(0.6, 0.6, 0.5)};
      RgbdFrame frame = kFollowedCorner.render(kCamera, truth_at(i));
      // Error that depends on the image position: a map of many frames cannot agree with a new frame.
      for (int y = 0; y < kCamera.height; ++y)
        for (std::uint16_t& units : frame.depth.units.row(y))
          units = static_cast<std::uint16_t>(std::lround(units * (1 + (scale - 1) * y / kCamera.height)));
      const Mat6 covariance = covariance_at(T_odom_camera.translation(), 3e-4 + stated_m_per_frame * i,
                                            2e-4 + 0.5 * stated_m_per_frame * i);
      const AlignmentResult found = aligner.align(bench.grid, frame.depth, T_odom_camera,
                                                  states_covariance ? covariance : Mat6::Zero());
      aligned = found.T_world_camera;
      EXPECT_LT(((aligner.T_map_odom() * T_odom_camera).translation() - aligned.translation()).norm(), 1e-9);
      bench.integrator.integrate(bench.grid, {frame, aligned});
    }
    return (aligned.translation() - truth_at(kFrames - 1).translation()).norm();
  }
};

TEST(TrajectoryAligner, APriorBetterThanTheMapIsNotSpoilt) {
  // Depth distorted by up to 5 %: with a moving camera, alignment shifts the pose.
  const double alone = Walk{1.05, 0, 0, false}.error_m(), told = Walk{1.05, 0, 0, true}.error_m();
  EXPECT_GT(alone, 3e-3);
  EXPECT_LT(told, 0.0015);
}

TEST(TrajectoryAligner, APriorWorseThanTheMapIsCorrected) {
  // 3.8 cm error at the end, half of it within odometry's covariance. The map follows by less than a third.
  const double told = Walk{1, 1e-3, 5e-4, true}.error_m();
  EXPECT_LT(told, 0.0125);
  const double alone = Walk{1, 1e-3, 5e-4, false}.error_m();
  EXPECT_LT(alone, 0.0125);
}

TEST(TrajectoryAligner, WhatOdometrySaysHoldsWhereverItsOriginIs) {
  IntegrationBench near_bench({}), far_bench({});
  const SE3 T_far_near(so3_exp(Vec3(0, 0, 0)), Vec3(40, -30, 10));
  // An empty map: the pose is the fusion of both priors, for any frame.
  TrajectoryAligner near_aligner({}, near_bench.params, {}, kCamera),
      far_aligner({}, far_bench.params, {}, kCamera);
  const SE3 T_map_odom(so3_exp(Vec3(0, 0, 1.2)), Vec3(5, 6, 7));
  near_aligner.set_T_map_odom(T_map_odom);
  far_aligner.set_T_map_odom(T_map_odom * T_far_near.inverse());
  const DepthImage depth = kFollowedCorner.render(kCamera, truth_at(0)).depth;
  for (int i = 0; i < 5; ++i) {
    const SE3 pose = truth_at(i), far_pose = T_far_near * pose;
    const auto a =
        near_aligner.align(near_bench.grid, depth, pose, covariance_at(pose.translation(), 2e-3, 1e-3));
    const auto b =
        far_aligner.align(far_bench.grid, depth, far_pose, covariance_at(far_pose.translation(), 2e-3, 1e-3));
    EXPECT_LT((a.T_world_camera.matrix() - b.T_world_camera.matrix()).norm(), 1e-8);
    EXPECT_LT((a.T_world_camera.matrix() - (T_map_odom * pose).matrix()).norm(), 1e-8);
  }
}

TEST(TrajectoryAligner, FadesToOdometryWithoutPictures) {
  // A correction no longer supported by depth images decays to odometry's pose, with a small covariance.
  IntegrationBench map({}), nothing({});
  for (int i = 0; i < 6; ++i) map.add(kFollowedCorner, truth_at(i));
  TrajectoryAligner aligner({}, map.params, {}, kCamera);
  const SE3 wrong(Mat3::Identity(), Vec3(0.01, 0.008, -0.006));
  for (int i = 0; i < 6; ++i) {
    const SE3 odom = wrong * truth_at(i);
    aligner.align(map.grid, kFollowedCorner.render(kCamera, truth_at(i)).depth, odom,
                  covariance_at(odom.translation(), 0.01, 0.005));
  }
  EXPECT_LT((aligner.T_map_odom() * wrong).translation().norm(), 0.004);  // it was corrected
  for (int i = 6; i < 12; ++i) {
    const SE3 odom = wrong * truth_at(i);
    const auto found = aligner.align(nothing.grid, kFollowedCorner.render(kCamera, truth_at(i)).depth, odom,
                                     covariance_at(odom.translation(), 3e-4, 2e-4));
    EXPECT_NE(found.status, AlignmentStatus::kAccepted);
  }
  EXPECT_LT(aligner.T_map_odom().translation().norm(), 1e-3);
}

/// With pose errors according to the prior and common scan errors according to shared_sigma_voxel, the
/// result's errors agree with its covariance.
TEST(DenseAligner, StatesAnHonestCovariance) {
  IntegrationBench bench({});
  for (int i = 0; i < 6; ++i) bench.add(kFollowedCorner, truth_at(5 * i));
  const AlignmentParams params;
  DenseAligner aligner(params, bench.params, {}, kCamera);
  const double shared_m = params.shared_sigma_voxel * bench.params.voxel_size_m;
  const auto normal3 = [](Rng& rng) { return Vec3(rng.normal(), rng.normal(), rng.normal()); };
  double sum = 0;
  constexpr int kSeeds = 60;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    Rng rng(static_cast<std::uint64_t>(seed));
    const SE3 truth = truth_at(seed % 25);
    // The readings' centre, about 1.6 m ahead; they lie about 0.6 m around it.
    const TurningCentre centre{truth * Vec3(0, 0, 1.6), 0.6};
    Vec6 shared;
    shared << shared_m * normal3(rng), shared_m / centre.arm_m * normal3(rng);
    const DepthImage depth = kFollowedCorner.render(kCamera, centre.moved(truth, shared)).depth;
    AlignmentParams of_prior;
    of_prior.prior_shift_sigma_m = 0.012, of_prior.prior_turn_sigma_rad = 0.01;
    const SE3 prior{so3_exp(0.01 * normal3(rng)) * truth.rotation(),
                    truth.translation() + 0.012 * normal3(rng)};
    const AlignmentResult found = aligner.align(bench.grid, depth, prior_of_given_pose(of_prior, prior));
    ASSERT_EQ(found.status, AlignmentStatus::kAccepted) << found.reason;
    const Vec6 error = TurningCentre{}.between(truth, found.T_world_camera);
    sum += error.dot(found.covariance.ldlt().solve(error)) / 6;
  }
  EXPECT_GT(sum / kSeeds, 0.7);
  EXPECT_LT(sum / kSeeds, 1.4);
}

}  // namespace
}  // namespace hm
