#include "hm/tsdf/alignment/dense_alignment.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <numbers>

#include "hm/tsdf/testing/integration_bench.hpp"

namespace hm {
namespace {

using testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180;

/// Walls, floor and two balls: every direction is observable.
const AnalyticScene kCorner{{{Vec3(-1, 0, 0), -2.0}, {Vec3(0, -1, 0), -0.7}, {Vec3(0, 0, 1), -0.6}},
                            {{Vec3(1.5, -0.3, 0.1), 0.3}}};
/// Four walls along x, without an end in range.
const AnalyticScene kCorridor{
    {{Vec3(0, 1, 0), -0.9}, {Vec3(0, -1, 0), -0.8}, {Vec3(0, 0, 1), -0.9}, {Vec3(0, 0, -1), -1.0}}, {}};

/// Map of a scene integrated from a few poses, and an aligner.
struct Alignment : IntegrationBench {
  explicit Alignment(const AnalyticScene& its_scene, const AlignmentParams& alignment = {})
      : IntegrationBench({}), scene(its_scene), aligner(alignment, params, {}, kCamera) {
    for (int i = 0; i < 6; ++i) add(scene, looking_along_x(Vec3(0.02 * i, 0.03 * i - 0.07, 0.02 * (i % 3))));
  }
  AlignmentResult align(const SE3& truth, const SE3& prior, const Mat6& information = Mat6::Zero()) {
    return aligner.align(grid, scene.render(kCamera, truth).depth, {prior, information});
  }
  AnalyticScene scene;
  DenseAligner aligner;
};

SE3 disturbed(const SE3& pose, const Vec3& shift_m, const Vec3& turn_rad) {
  return {so3_exp(turn_rad) * pose.rotation(), pose.translation() + shift_m};
}

TEST(DenseAligner, FindsTheWayBackFromTwoCentimetresAndADegree) {
  Alignment bench(kCorner);
  const SE3 truth = looking_along_x(Vec3(0.03, 0.01, 0.01));
  Rng rng(4);
  for (int i = 0; i < 30; ++i) {
    const Vec3 a(rng.normal(), rng.normal(), rng.normal()), b(rng.normal(), rng.normal(), rng.normal());
    const auto found = bench.align(truth, disturbed(truth, 0.02 * a.normalized(), kDegree * b.normalized()));
    ASSERT_EQ(found.status, AlignmentStatus::kAccepted) << found.reason;
    EXPECT_EQ(found.unobservable_directions, 0);
    EXPECT_LT((truth.inverse() * found.T_world_camera).translation().norm(), 1e-3);
    EXPECT_LT((truth.inverse() * found.T_world_camera).angle(), 0.02 * kDegree);
    EXPECT_LT(found.after.rms_m, found.before.rms_m);
    EXPECT_LT(found.after.cost, found.before.cost);
    EXPECT_GT(found.after.inlier_ratio, 0.95);
  }
}

TEST(DenseAligner, SearchesAlongTheRaysWhereTheDistanceIsSaturated) {
  Alignment bench(kCorner);
  const SE3 truth = looking_along_x(Vec3(0.03, 0.01, 0.01));
  Rng rng(8);
  for (int i = 0; i < 10; ++i) {
    const Vec3 a(rng.normal(), rng.normal(), rng.normal()), b(rng.normal(), rng.normal(), rng.normal());
    const auto found =
        bench.align(truth, disturbed(truth, 0.07 * a.normalized(), 3 * kDegree * b.normalized()));
    ASSERT_EQ(found.status, AlignmentStatus::kAccepted) << found.reason;
    EXPECT_LT((truth.inverse() * found.T_world_camera).translation().norm(), 1e-3);
  }
  EXPECT_TRUE(bench.align(truth, disturbed(truth, Vec3(0.07, 0, 0), Vec3::Zero())).searched);
}

TEST(DenseAligner, APlaneLeavesThreeDirectionsAtThePrior) {
  Alignment bench(kWall);
  const SE3 truth = looking_along_x(Vec3::Zero());
  const SE3 prior = disturbed(truth, Vec3(0.015, 0.02, -0.01), Vec3(0.02, 0.01, -0.008));
  const auto found = bench.align(truth, prior);
  ASSERT_EQ(found.status, AlignmentStatus::kAccepted) << found.reason;
  EXPECT_EQ(found.unobservable_directions, 3);
  for (int i = 3; i < 6; ++i) EXPECT_GT(found.observability[i], 0.1);
  EXPECT_NEAR(found.T_world_camera.translation().y(), prior.translation().y(), 2e-3);
  EXPECT_NEAR(found.T_world_camera.translation().z(), prior.translation().z(), 2e-3);
  // The optical axis is perpendicular to the wall again, at 2 m; the roll about it is that of the prior.
  const Mat3 turn = found.T_world_camera.rotation() * truth.rotation().transpose();
  EXPECT_LT(std::acos(std::min(1.0, turn(0, 0))), 0.03 * kDegree);
  EXPECT_NEAR(so3_log(turn).x(), 0.02, 5e-4);
}

TEST(DenseAligner, ACorridorLeavesItsAxisAtThePrior) {
  AlignmentParams true_camera;
  true_camera.systematic_per_m = 0;
  Alignment bench(kCorridor, true_camera);
  const SE3 truth = looking_along_x(Vec3(0.05, 0.01, 0));
  const SE3 prior = disturbed(truth, Vec3(0.03, 0.012, -0.012), Vec3(0.01, -0.008, 0.012));
  const auto found = bench.align(truth, prior);
  ASSERT_EQ(found.status, AlignmentStatus::kAccepted) << found.reason;
  EXPECT_EQ(found.unobservable_directions, 1) << found.observability.transpose() << "\n" << found.directions;
  EXPECT_NEAR(std::abs(found.directions(0, 0)), 1.0, 0.02);
  EXPECT_NEAR(found.T_world_camera.translation().x(), prior.translation().x(), 1e-5);
  EXPECT_LT((found.T_world_camera.translation() - truth.translation()).tail<2>().norm(), 1e-3);
  EXPECT_LT((truth.inverse() * found.T_world_camera).angle(), 0.03 * kDegree);
  // Unobservable directions have a large variance, observable ones do not.
  EXPECT_GT(found.covariance(0, 0), 100 * found.covariance(1, 1));
}

TEST(DenseAligner, AStrongPriorIsKept) {
  Alignment bench(kCorner);
  const SE3 truth = looking_along_x(Vec3(0.03, 0.01, 0.01)),
            prior = disturbed(truth, Vec3(0.01, 0, 0), Vec3::Zero());
  const auto found = bench.align(truth, prior, 1e12 * Mat6::Identity());
  EXPECT_LT((prior.inverse() * found.T_world_camera).translation().norm(), 1e-4);
  AlignmentParams sure;
  sure.prior_shift_sigma_m = sure.prior_turn_sigma_rad = 1e-6;
  const AlignmentPrior given = prior_of_given_pose(sure, prior);
  EXPECT_LT((prior.inverse() * bench.align(truth, prior, given.information).T_world_camera).log().norm(),
            1e-4);
}

TEST(DenseAligner, WhereTheWorldsOriginIsDoesNotMatter) {
  // The same scene at 5 km: the walls moved, the poses with them.
  const Vec3 far(5000, -3000, 1000);
  AnalyticScene scene = kCorner;
  for (auto& plane : scene.planes) plane.offset_m += plane.normal.dot(far);
  for (auto& ball : scene.balls) ball.centre += far;
  IntegrationBench bench({});
  for (int i = 0; i < 6; ++i)
    bench.add(scene, looking_along_x(far + Vec3(0.02 * i, 0.03 * i - 0.07, 0.02 * (i % 3))));
  DenseAligner aligner({}, bench.params, {}, kCamera);
  const SE3 truth = looking_along_x(far + Vec3(0.03, 0.01, 0.01));
  const auto found = aligner.align(bench.grid, scene.render(kCamera, truth).depth,
                                   {disturbed(truth, Vec3(0.01, -0.01, 0.01), Vec3(0.01, 0, -0.01))});
  ASSERT_EQ(found.status, AlignmentStatus::kAccepted) << found.reason;
  EXPECT_EQ(found.unobservable_directions, 0)
      << found.observability.transpose() << " in " << found.after.inlier_ratio << " ov "
      << found.after.overlap_ratio << " s " << found.searched;
  EXPECT_LT((found.T_world_camera.translation() - truth.translation()).norm(), 1e-3);
}

TEST(DenseAligner, APriorTooFarOffIsKeptAndSaidSo) {
  Alignment bench(kCorner);
  const SE3 truth = looking_along_x(Vec3(0.03, 0.01, 0.01));
  for (const Vec3& shift : {Vec3(0.6, 0, 0), Vec3(-0.7, 0.3, 0), Vec3(0, 0, 40)}) {
    const SE3 prior = disturbed(truth, shift, Vec3::Zero());
    const auto found = bench.align(truth, prior);
    EXPECT_NE(found.status, AlignmentStatus::kAccepted) << shift.transpose();
    EXPECT_FALSE(found.reason.empty());
    EXPECT_EQ(found.T_world_camera.matrix(), prior.matrix());
  }
}

TEST(DenseAligner, WithoutAMapOrReadingsThePriorIsKept) {
  Alignment bench(kCorner);
  const SE3 prior = looking_along_x(Vec3::Zero());
  VolumeGrid empty = Integrator::make_grid(bench.params);
  const auto no_map = bench.aligner.align(empty, bench.scene.render(kCamera, prior).depth, {prior});
  EXPECT_EQ(no_map.status, AlignmentStatus::kTooLittleOverlap);
  EXPECT_THAT(no_map.reason, HasSubstr("0 % of the readings lie on the map"));
  EXPECT_EQ(no_map.T_world_camera.matrix(), prior.matrix());
  DepthImage nothing;
  nothing.units = Image<std::uint16_t>(kCamera.width, kCamera.height);
  const auto no_readings = bench.aligner.align(bench.grid, nothing, {prior});
  EXPECT_EQ(no_readings.status, AlignmentStatus::kUnusable);
  EXPECT_THAT(no_readings.reason, HasSubstr("0 usable readings"));
}

TEST(DenseAligner, UnusableInputIsNamed) {
  Alignment bench(kCorner);
  const SE3 pose = looking_along_x(Vec3::Zero());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(bench.align(pose, SE3(Mat3::Identity(), Vec3(nan, 0, 0))).reason, HasSubstr("finite"));
  EXPECT_THAT(bench.align(pose, SE3(2 * Mat3::Identity(), Vec3::Zero())).reason, HasSubstr("rigid"));
  EXPECT_THAT(bench.align(pose, SE3(Mat3::Identity(), Vec3(1e9, 0, 0))).reason, HasSubstr("from the origin"));
  EXPECT_THAT(bench.align(pose, pose, Mat6::Constant(nan)).reason, HasSubstr("information"));
  DepthImage small;
  small.units = Image<std::uint16_t>(7, 5);
  EXPECT_THAT(bench.aligner.align(bench.grid, small, {pose}).reason, HasSubstr("7 x 5"));
}

TEST(DenseAligner, GivesTheSameBitsAgainAndFromPackedVolumes) {
  Alignment bench(kCorner);
  const SE3 truth = looking_along_x(Vec3(0.03, 0.01, 0.01)),
            prior = disturbed(truth, Vec3(0.01, 0, 0.01), Vec3(0, 0.01, 0));
  const auto first = bench.align(truth, prior), second = bench.align(truth, prior);
  EXPECT_EQ(first.T_world_camera.matrix(), second.T_world_camera.matrix());
  for (const VolumeKey key : bench.grid.sorted_keys()) bench.grid.pack(key);
  const auto third = bench.align(truth, prior);
  EXPECT_EQ(first.T_world_camera.matrix(), third.T_world_camera.matrix());
  EXPECT_EQ(first.covariance, third.covariance);
}

}  // namespace
}  // namespace hm
