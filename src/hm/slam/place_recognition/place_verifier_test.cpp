#include "hm/slam/place_recognition/place_verifier.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "hm/geometry/pose_graph_3d.hpp"
#include "hm/slam/rgbd/testing/landmark_world.hpp"

namespace hm {
namespace {

struct TwoViews {
  Keyframe a, b;
  SE3 T_a_b;
};

TwoViews two_views(std::uint64_t seed, double step_m = 0.4) {
  Rng rng(seed);
  const test::LandmarkWorld world = test::corridor(8, 60, rng);
  const SE3 T_world_a = test::level_camera(0, 0, 0.1), T_world_b = test::level_camera(step_m, 0.1, -0.1);
  TwoViews views;
  views.a.features = test::see(world, T_world_a, rng);
  views.b.features = test::see(world, T_world_b, rng);
  views.T_a_b = T_world_a.inverse() * T_world_b;
  return views;
}

Vec6 error_of(const SE3& estimate, const SE3& truth) {
  PoseEdge3D edge;
  edge.T_from_to = estimate;
  return pose_edge_error(edge, SE3(), truth);
}

TEST(PlaceVerifier, MotionAndHonestCovariance) {
  double nees = 0;
  constexpr int kSeeds = 40;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const TwoViews views = two_views(seed);
    const PlaceMatch match = verify_place(views.a, views.b);
    ASSERT_TRUE(match.is_same_place()) << to_string(match.outcome);
    const Vec6 error = error_of(match.T_a_b, views.T_a_b);
    EXPECT_LT(error.norm(), 0.02);
    PlaceVerifierParams bare;
    bare.sigma_floor_m = bare.sigma_floor_rad = 0;
    const PlaceMatch without_floor = verify_place(views.a, views.b, bare);
    nees += error.dot(without_floor.covariance.llt().solve(error)) / (6 * kSeeds);
  }
  EXPECT_GT(nees, 0.5);
  EXPECT_LT(nees, 2.0);
}

TEST(PlaceVerifier, SwappingInverts) {
  const TwoViews views = two_views(3);
  const PlaceMatch there = verify_place(views.a, views.b), back = verify_place(views.b, views.a);
  EXPECT_LT(error_of(there.T_a_b, back.T_a_b.inverse()).norm(), 0.01);
  EXPECT_EQ(there.matches, back.matches);
}

/// Up to 60 % of the matches are outliers.
TEST(PlaceVerifier, OutliersAreLeftOut) {
  for (const double lies : {0.2, 0.4, 0.6}) {
    TwoViews views = two_views(4);
    std::vector<FeaturePair> matches = match_features(views.a.features, views.b.features, {});
    ASSERT_GT(matches.size(), 80U);
    Rng rng(5);
    for (FeaturePair& match : matches)
      if (rng.uniform() < lies) match.second = rng.below(static_cast<std::uint32_t>(views.b.features.size()));
    const auto found = register_features(views.a.features, views.b.features, matches, {});
    ASSERT_TRUE(found);
    EXPECT_LT(error_of(found->T_a_b, views.T_a_b).norm(), 0.02) << lies;
    EXPECT_LT(found->inliers.size(), matches.size());
  }
}

/// Regression: the three matches of a sample were counted twice, so that 27 became 30.
TEST(PlaceVerifier, SeedsCountOnce) {
  const TwoViews views = two_views(6);
  std::vector<FeaturePair> matches = match_features(views.a.features, views.b.features, {});
  std::vector<FeaturePair> good;
  for (const FeaturePair& match : matches)
    if (match_chi2(views.a.features[match.first], views.b.features[match.second], views.T_a_b) < 4)
      good.push_back(match);
  ASSERT_GT(good.size(), 27U);
  good.resize(27);
  const auto found = register_features(views.a.features, views.b.features, good, {});
  ASSERT_TRUE(found);
  EXPECT_LE(found->inliers.size(), 27U);
  for (std::size_t i = 1; i < found->inliers.size(); ++i) EXPECT_LT(found->inliers[i - 1], found->inliers[i]);
}

/// A fixed threshold of 3 cm is less than one standard deviation at 4.5 m: inliers are tested by their
/// uncertainty, with an upper limit.
TEST(PlaceVerifier, InliersByUncertaintyWithACap) {
  Feature a, b;
  a.has_depth = b.has_depth = true;
  a.p_camera = Vec3(0, 0, 4.5);
  b.p_camera = Vec3(0, 0, 4.56);
  a.covariance = b.covariance = Vec3(1e-4, 1e-4, 0.03 * 0.03).asDiagonal();
  EXPECT_NEAR(match_chi2(a, b, SE3()), 0.06 * 0.06 / (2 * 0.03 * 0.03), 1e-12);
  b.p_camera.z() = 4.7;  // within three standard deviations of a very uncertain pair, but over the limit
  b.covariance(2, 2) = 1;
  EXPECT_LT(match_chi2(a, b, SE3()), 11.34);
  EXPECT_TRUE(match_guided({a}, {b}, SE3(), {}).empty());
  b.p_camera.z() = 4.6;
  EXPECT_EQ(match_guided({a}, {b}, SE3(), {}).size(), 1U);
}

TEST(PlaceVerifier, JacobianAgainstDifferences) {
  Rng rng(9);
  for (int trial = 0; trial < 30; ++trial) {
    const SE3 T = SE3::exp(Vec6::NullaryExpr([&rng] { return rng.normal(); }));
    const Vec3 p_a(1, 2, 3), p_b(rng.normal(), rng.normal(), rng.normal());
    const auto jacobian = match_jacobian(T, p_b);
    for (int k = 0; k < 6; ++k) {
      Vec6 move = Vec6::Zero();
      move[k] = 1e-6;
      const Vec3 difference = ((p_a - moved_by(T, move) * p_b) - (p_a - moved_by(T, -move) * p_b)) / 2e-6;
      EXPECT_LT((difference - jacobian.col(k)).norm(), 1e-7);
    }
  }
}

TEST(PlaceVerifier, OtherPlacesAndDegenerateViews) {
  const TwoViews here = two_views(10), elsewhere = two_views(11);
  EXPECT_FALSE(verify_place(here.a, elsewhere.b).is_same_place());
  Keyframe empty;
  EXPECT_EQ(verify_place(empty, here.a).outcome, PlaceOutcome::kFewMatches);
  EXPECT_EQ(verify_place(here.a, empty).outcome, PlaceOutcome::kFewMatches);
  EXPECT_TRUE(match_features(empty.features, here.a.features, {}).empty());
  // All features on a line: the rotation about it is undetermined.
  Rng rng(12);
  Keyframe line;
  for (int i = 0; i < 60; ++i) {
    Feature feature;
    feature.has_depth = true;
    feature.descriptor = test::random_descriptor(rng);
    feature.p_camera = Vec3(0.05 * i, 0, 2);
    feature.covariance = Mat3::Identity() * 1e-5;
    line.features.push_back(feature);
  }
  EXPECT_FALSE(verify_place(line, line).is_same_place());
}

/// A wall with a repetition within the image: two transforms explain it, neither is accepted.
TEST(PlaceVerifier, RivalMotionIsAmbiguous) {
  Rng rng(13);
  Keyframe a, b;
  const auto add = [&rng](Keyframe& keyframe, const Vec3& p, const BinaryDescriptor& descriptor) {
    Feature feature;
    feature.has_depth = true;
    feature.descriptor = descriptor;
    feature.p_camera = p;
    feature.covariance = Mat3::Identity() * 1e-5;
    keyframe.features.push_back(feature);
  };
  for (int i = 0; i < 100; ++i) {
    const Vec3 p(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(2, 3));
    const BinaryDescriptor descriptor = test::random_descriptor(rng);
    add(a, p, descriptor);
    add(b, p + (i % 2 == 0 ? Vec3(0.5, 0, 0) : Vec3(-0.5, 0, 0)), descriptor);
  }
  EXPECT_EQ(verify_place(a, b).outcome, PlaceOutcome::kAmbiguous);
}

}  // namespace
}  // namespace hm
