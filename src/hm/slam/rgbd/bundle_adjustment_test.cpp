#include "hm/slam/rgbd/bundle_adjustment.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hm/geometry/pose_graph_3d.hpp"
#include "hm/slam/rgbd/testing/landmark_world.hpp"

namespace hm {
namespace {

TEST(BundleAdjustment, JacobianAgainstDifferences) {
  Rng rng(1);
  PinholeCamera camera = test::landmark_camera();
  for (const double fy : {525.0, -480.0}) {
    camera.fy = fy;
    for (int trial = 0; trial < 50; ++trial) {
      const SE3 T = SE3::exp(Vec6::NullaryExpr([&rng] { return rng.normal(); }));
      const Vec3 p_map = T * Vec3(rng.normal(), rng.normal(), rng.uniform(1, 5));
      const auto residual = [&camera](const SE3& T_map_camera, const Vec3& p) {
        const Vec3 p_camera = T_map_camera.inverse() * p;
        const Vec2 pixel = camera.project(p_camera);
        return Vec3(pixel.x(), pixel.y(), p_camera.z());
      };
      const auto jacobian = observation_jacobian(camera, T, p_map);
      constexpr double kStep = 1e-6;
      for (int k = 0; k < 9; ++k) {
        Vec6 move = Vec6::Zero();
        Vec3 shift = Vec3::Zero();
        (k < 6 ? move[k] : shift[k - 6]) = kStep;
        const Vec3 difference =
            (residual(moved_by(T, move), p_map + shift) - residual(moved_by(T, -move), p_map - shift)) /
            (2 * kStep);
        EXPECT_LT((difference - jacobian.col(k)).norm(), 1e-3 + 1e-6 * jacobian.col(k).norm());
      }
    }
  }
}

constexpr double kPixelSigma_px = 0.7;

/// Keyframes around a point cloud, with links between features of the same point.
struct Scene {
  std::vector<Keyframe> keyframes;
  std::vector<const Keyframe*> pointers;
  std::vector<SE3> truth, disturbed;
  std::vector<FeatureLink> links;
};

Scene make_scene(std::uint64_t seed, double disturbance, double wrong_links_ratio = 0) {
  Rng rng(seed);
  test::LandmarkWorld world = test::corridor(6, 40, rng);
  Scene scene;
  std::vector<std::vector<std::uint32_t>> owner;  // point of each keyframe's features
  for (int i = 0; i < 8; ++i) {
    scene.truth.push_back(test::level_camera(0.25 * i, 0.1 * std::sin(i), 0.05 * std::cos(i)));
    Keyframe keyframe;
    keyframe.features = test::see(world, scene.truth.back(), rng, {kPixelSigma_px, 0.0014, 0, 4.5, 1000});
    owner.emplace_back();
    for (const Feature& feature : keyframe.features)
      for (std::uint32_t p = 0; p < world.points.size(); ++p)
        if (world.points[p].descriptor == feature.descriptor) owner.back().push_back(p);
    scene.keyframes.push_back(std::move(keyframe));
  }
  for (std::uint32_t a = 0; a < 8; ++a)
    for (std::uint32_t b = a + 1; b < std::min(a + 3, 8U); ++b)
      for (std::uint32_t f = 0; f < owner[a].size(); ++f)
        for (std::uint32_t g = 0; g < owner[b].size(); ++g)
          if (owner[a][f] == owner[b][g]) scene.links.push_back({a, f, b, g});
  for (FeatureLink& link : scene.links)
    if (rng.uniform() < wrong_links_ratio)
      link.feature_b = rng.below(static_cast<std::uint32_t>(owner[link.keyframe_b].size()));
  for (std::size_t i = 0; i < 8; ++i) {
    Vec6 move = Vec6::NullaryExpr([&rng] { return rng.normal(); }) * disturbance;
    if (i == 0) move.setZero();
    scene.disturbed.push_back(moved_by(scene.truth[i], move));
    scene.pointers.push_back(&scene.keyframes[i]);
  }
  return scene;
}

Bundle bundle_of(const Scene& scene) {
  Bundle bundle{test::landmark_camera(), scene.disturbed, {}, {0}, {}};
  make_landmarks(bundle, scene.pointers, scene.links, {kPixelSigma_px, 1});
  return bundle;
}

double error_of(const std::vector<SE3>& poses, const std::vector<SE3>& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < poses.size(); ++i)
    sum += (poses[i].translation() - truth[i].translation()).squaredNorm();
  return std::sqrt(sum / static_cast<double>(poses.size()));
}

TEST(BundleAdjustment, BringsKeyframesToTheirPlaces) {
  double sum = 0;
  constexpr int kSeeds = 6;
  for (int seed = 2; seed < 2 + kSeeds; ++seed) {
    const Scene scene = make_scene(static_cast<std::uint64_t>(seed), 0.02);
    Bundle bundle = bundle_of(scene);
    ASSERT_GT(bundle.landmarks.size(), 100U);
    const BundleResult result = adjust_bundle(bundle);
    EXPECT_TRUE(result.converged) << result.message;
    EXPECT_GT(error_of(scene.disturbed, scene.truth), 0.02);
    sum += std::pow(error_of(bundle.T_map_camera, scene.truth), 2);
    EXPECT_LT(result.final_cost, result.initial_cost);
    EXPECT_GT(result.error_before_px, 3);
    // The noise of a pixel, in two directions: the median of a Rayleigh distribution.
    EXPECT_NEAR(result.error_after_px, kPixelSigma_px * std::sqrt(2 * std::log(2.0)), 0.2);
    EXPECT_EQ(bundle.T_map_camera[0].matrix(), scene.truth[0].matrix());
  }
  EXPECT_LT(std::sqrt(sum / kSeeds), 0.0045);
}

/// Conjugate gradients, for keyframes that all share landmarks, find the same optimum as the factorisation.
TEST(BundleAdjustment, ConjugateGradientsFindTheSamePoses) {
  const Scene scene = make_scene(2, 0.02);
  Bundle bundle = bundle_of(scene), factorised = bundle;
  BundleParams params;
  params.most_covisible = 2;
  const BundleResult result = adjust_bundle(bundle, params), same = adjust_bundle(factorised);
  ASSERT_TRUE(result.converged && same.converged);
  EXPECT_TRUE(result.conjugate_gradients);
  EXPECT_FALSE(same.conjugate_gradients);
  EXPECT_NEAR(result.final_cost, same.final_cost, 1e-3 * same.final_cost);
  const double error_m = error_of(factorised.T_map_camera, scene.truth);
  EXPECT_LT(error_of(bundle.T_map_camera, factorised.T_map_camera), 0.1 * error_m);
}

/// Keyframes 0 to 3 in a row, each sharing one or two landmarks with the next: 1.5 others on average.
TEST(BundleAdjustment, TheSolverDependsOnTheKeyframesThatShareLandmarks) {
  Bundle bundle{test::landmark_camera(), {}, {}, {0}, {}};
  for (int k = 0; k < 4; ++k) bundle.T_map_camera.push_back(test::level_camera(0.1 * k, 0, 0));
  const auto sight = [&](std::uint32_t k, const Vec3& p_map) {
    const Vec3 p = bundle.T_map_camera[k].inverse() * p_map;
    return BundleObservation{k, bundle.camera.project(p), Eigen::Matrix2d::Identity(), p.z(), 0.01};
  };
  for (const std::uint32_t k : {0, 1, 1, 2}) {
    const Vec3 p_map(3, 0.1 * k, 0.2);
    bundle.landmarks.push_back({p_map, {sight(k, p_map), sight(k + 1, p_map)}});
  }
  for (const double most : {1.4, 1.6}) {
    BundleParams params;
    params.most_covisible = most;
    Bundle adjusted = bundle;
    const BundleResult result = adjust_bundle(adjusted, params);
    EXPECT_TRUE(result.converged) << result.message;
    EXPECT_EQ(result.conjugate_gradients, most < 1.5);
  }
}

/// Every fiftieth link is false, which the robust loss must tolerate; ambiguous landmarks are dropped.
TEST(BundleAdjustment, BearsWrongLinks) {
  Scene scene = make_scene(3, 0.01, 0.02);
  Bundle bundle = bundle_of(scene);
  for (const BundleLandmark& landmark : bundle.landmarks)
    for (std::size_t i = 1; i < landmark.observations.size(); ++i)
      EXPECT_LT(landmark.observations[i - 1].keyframe, landmark.observations[i].keyframe);
  EXPECT_TRUE(adjust_bundle(bundle).converged);
  EXPECT_LT(error_of(bundle.T_map_camera, scene.truth), 0.01);
}

/// Observations five times more accurate than stated, some of them displaced, in opposite directions in every
/// other keyframe: they are detected as outliers relative to the others.
TEST(BundleAdjustment, MeasuresOutliersByWhatTheOthersDo) {
  double slipped = 0, modest = 0;
  for (int seed = 10; seed < 14; ++seed) {
    const Scene scene = make_scene(static_cast<std::uint64_t>(seed), 0.01);
    Bundle bundle = bundle_of(scene);
    Rng rng(1);
    for (BundleLandmark& landmark : bundle.landmarks)
      for (BundleObservation& seen : landmark.observations)
        if (rng.uniform() < 0.15) seen.pixel.x() += seen.keyframe % 2 == 0 ? 6 : -6;
    Bundle wide = bundle;
    for (BundleLandmark& landmark : wide.landmarks)
      for (BundleObservation& seen : landmark.observations) {
        seen.pixel_covariance *= 25;
        seen.depth_sigma_m *= 5;
      }
    ASSERT_TRUE(adjust_bundle(bundle).converged);
    ASSERT_TRUE(adjust_bundle(wide).converged);
    slipped += error_of(bundle.T_map_camera, scene.truth);
    modest += error_of(wide.T_map_camera, scene.truth);
  }
  EXPECT_LT(modest, 1.2 * slipped);
}

/// Landmarks that a wrong link has put behind one of their cameras do not prevent the adjustment.
TEST(BundleAdjustment, DropsObservationsBehindTheirCamera) {
  const Scene scene = make_scene(3, 0.01);
  Bundle clean = bundle_of(scene), bundle = clean;
  const BundleResult expected = adjust_bundle(clean);
  ASSERT_TRUE(expected.converged);
  EXPECT_EQ(expected.observations_behind, 0U);
  // One landmark has an observation behind its camera, another has only one observation in front.
  const SE3 looking_away = bundle.T_map_camera[7] * SE3(so3_exp(Vec3(0, std::numbers::pi, 0)), Vec3::Zero());
  bundle.T_map_camera.push_back(looking_away);
  const BundleObservation wrong{8, Vec2(320, 240), Eigen::Matrix2d::Identity(), 0, 0};
  const auto seen_by_7 = std::ranges::find_if(
      bundle.landmarks, [](const BundleLandmark& l) { return l.observations.back().keyframe == 7; });
  ASSERT_NE(seen_by_7, bundle.landmarks.end());
  BundleLandmark behind = *seen_by_7;
  seen_by_7->observations.push_back(wrong);
  behind.observations = {behind.observations.back(), wrong};
  bundle.landmarks.push_back(behind);
  const BundleResult result = adjust_bundle(bundle);
  ASSERT_TRUE(result.converged) << result.message;
  EXPECT_EQ(result.observations_behind, 2U);
  EXPECT_EQ(result.observations, expected.observations);
  for (std::size_t i = 0; i < 8; ++i)
    EXPECT_LT((bundle.T_map_camera[i].inverse() * clean.T_map_camera[i]).log().norm(), 1e-9);
  EXPECT_EQ(bundle.T_map_camera[8].matrix(), looking_away.matrix());
}

TEST(BundleAdjustment, SaysThatNothingIsInFrontOfItsCamera) {
  Bundle bundle{test::landmark_camera(), {SE3(), SE3()}, {}, {0}, {}};
  const BundleObservation seen{0, Vec2(320, 240), Eigen::Matrix2d::Identity(), 0, 0};
  bundle.landmarks = {{Vec3(0, 0, -1), {seen, seen}}};
  bundle.landmarks[0].observations[1].keyframe = 1;
  const BundleResult result = adjust_bundle(bundle);
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.observations_behind, 2U);
  EXPECT_THAT(result.message, testing::HasSubstr("behind"));
}

TEST(BundleAdjustment, ReportsProgressAndStopsWithWhatThereIs) {
  const Scene scene = make_scene(2, 0.05);
  Bundle bundle = bundle_of(scene);
  std::stop_source stop;
  std::vector<Progress> progress;
  RunContext run;
  run.stop = stop.get_token();
  run.progress = [&](const Progress& now) {
    progress.push_back(now);
    if (now.done == 3) stop.request_stop();
  };
  const BundleResult result = adjust_bundle(bundle, {}, run);
  EXPECT_TRUE(result.interrupted);
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.iterations, 3);
  ASSERT_EQ(progress.size(), 4U);  // the beginning, and each iteration
  EXPECT_EQ(progress.back().stage, "bundle adjustment");
  EXPECT_EQ(progress.back().total, 60U);
  EXPECT_LT(error_of(bundle.T_map_camera, scene.truth), 0.5 * error_of(scene.disturbed, scene.truth));
}

TEST(BundleAdjustment, DeterministicAndDegenerate) {
  Scene scene = make_scene(4, 0.02);
  Bundle one = bundle_of(scene), other = one;
  adjust_bundle(one);
  adjust_bundle(other);
  for (std::size_t i = 0; i < one.T_map_camera.size(); ++i)
    EXPECT_EQ(one.T_map_camera[i].matrix(), other.T_map_camera[i].matrix());
  one.landmarks.clear();
  EXPECT_FALSE(adjust_bundle(one).converged);
  make_landmarks(one, scene.pointers, {});
  EXPECT_TRUE(one.landmarks.empty());
  // Two features of one keyframe in one landmark: ambiguous.
  const FeatureLink twice[] = {{0, 1, 1, 1}, {0, 2, 1, 1}};
  make_landmarks(one, scene.pointers, twice);
  EXPECT_TRUE(one.landmarks.empty());
  // A landmark without depth in any keyframe has no position.
  for (Keyframe& keyframe : scene.keyframes)
    for (Feature& feature : keyframe.features) feature.has_depth = false;
  make_landmarks(one, scene.pointers, scene.links);
  EXPECT_TRUE(one.landmarks.empty());
}

/// Odometry's landmarks keep its observations; a link adds one observation to the older feature's landmark.
TEST(BundleAdjustment, LinksJoinOdometrysLandmarks) {
  Scene scene = make_scene(5, 0.0);
  const Eigen::Matrix2d certain = 0.01 * Eigen::Matrix2d::Identity();
  const auto sight = [&](std::size_t keyframe, std::size_t feature, std::uint64_t landmark) {
    const Feature& f = scene.keyframes[keyframe].features[feature];
    scene.keyframes[keyframe].observations.push_back(
        {landmark, f.pixel + Vec2(0.5, 0), certain, f.p_camera.z(), 1e-4});
  };
  sight(0, 0, 7);  // 7 is seen by 0 and 1, 9 by 4 alone
  sight(1, 0, 7);
  sight(4, 3, 9);
  Bundle bundle = bundle_of(scene);
  const FeatureLink links[] = {{0, 0, 4, 3}, {1, 0, 4, 3}, {4, 3, 5, 2}, {0, 9, 5, 6}, {0, 0, 1, 0}};
  make_landmarks(bundle, scene.pointers, links);
  ASSERT_EQ(bundle.landmarks.size(), 3U);
  const auto keyframes_of = [](const BundleLandmark& landmark) {
    std::vector<std::uint32_t> keyframes;
    for (const BundleObservation& seen : landmark.observations) keyframes.push_back(seen.keyframe);
    return keyframes;
  };
  EXPECT_THAT(keyframes_of(bundle.landmarks[0]), testing::ElementsAre(0, 1, 4));
  EXPECT_THAT(keyframes_of(bundle.landmarks[1]), testing::ElementsAre(4, 5));
  EXPECT_THAT(keyframes_of(bundle.landmarks[2]), testing::ElementsAre(0, 5));
  EXPECT_EQ(bundle.landmarks[0].observations[0].pixel_covariance, certain);
  EXPECT_EQ(bundle.landmarks[0].observations[2].pixel, scene.keyframes[4].features[3].pixel);
  EXPECT_GT(bundle.landmarks[0].observations[2].pixel_covariance(0, 0), 0.1);
}

/// Refined observations are preferred, since their depths are averaged over more frames.
TEST(BundleAdjustment, ObservationsAreTakenAsTheNextKeyframeRefinesThem) {
  Scene scene = make_scene(5, 0.0);
  const auto sight = [&](std::size_t keyframe, double depth_m) {
    const Feature& f = scene.keyframes[keyframe].features[0];
    return LandmarkObservation{7, f.pixel, 0.01 * Eigen::Matrix2d::Identity(), depth_m, 1e-4};
  };
  for (const std::size_t keyframe : {0U, 1U, 2U}) {
    scene.keyframes[keyframe].frame_index = 10 * keyframe;
    scene.keyframes[keyframe].observations = {sight(keyframe, 2.0)};
  }
  scene.keyframes[1].before = {0, {sight(0, 2.1)}};
  scene.keyframes[2].before = {7, {sight(1, 2.2)}};
  Bundle bundle = bundle_of(scene);
  make_landmarks(bundle, scene.pointers, {});
  ASSERT_EQ(bundle.landmarks.size(), 1U);
  const auto& seen = bundle.landmarks[0].observations;
  ASSERT_EQ(seen.size(), 3U);
  EXPECT_EQ(seen[0].depth_m, 2.1);
  EXPECT_EQ(seen[1].depth_m, 2.0) << "refined for a keyframe that is not here";
  EXPECT_EQ(seen[2].depth_m, 2.0);
}

/// The numbers of observations per landmark and of landmarks per feature are limited for any number of links.
TEST(BundleAdjustment, LinksAddABoundedNumberOfObservations) {
  Scene scene = make_scene(5, 0.0);
  ASSERT_GE(scene.keyframes.size(), 8U);
  const auto sight = [&](std::size_t keyframe, std::uint64_t landmark) {
    const Feature& f = scene.keyframes[keyframe].features[0];
    scene.keyframes[keyframe].observations = {
        {landmark, f.pixel, 0.01 * Eigen::Matrix2d::Identity(), f.p_camera.z(), 1e-4}};
  };
  for (std::size_t k = 0; k < 7; ++k) sight(k, 100 + k);
  std::vector<FeatureLink> links;
  for (std::uint32_t k = 0; k < 7; ++k) links.push_back({k, 0, 7, 0});
  Bundle bundle = bundle_of(scene);
  make_landmarks(bundle, scene.pointers, links);
  EXPECT_EQ(bundle.landmarks.size(), 3U);
  links.clear();
  for (std::uint32_t f = 0; f < 40; ++f)
    for (std::uint32_t k = 1; k < 8; ++k) links.push_back({0, 0, k, f});
  make_landmarks(bundle, scene.pointers, links);
  for (const BundleLandmark& landmark : bundle.landmarks) EXPECT_LE(landmark.observations.size(), 7U);
}

/// A keyframe without landmarks is moved with its neighbour by an edge.
TEST(BundleAdjustment, EdgesCarryKeyframesWithoutLandmarks) {
  Scene scene = make_scene(6, 0.02);
  scene.keyframes[7].features.clear();
  std::erase_if(scene.links, [](const FeatureLink& l) { return l.keyframe_b == 7; });
  Bundle bundle = bundle_of(scene);
  const SE3 T_6_7 = scene.truth[6].inverse() * scene.truth[7];
  bundle.edges.push_back({6, 7, T_6_7, 1e6 * Mat6::Identity(), PoseEdgeKind::kOdometry});
  ASSERT_TRUE(adjust_bundle(bundle).converged);
  EXPECT_LT((bundle.T_map_camera[6].inverse() * bundle.T_map_camera[7] * T_6_7.inverse()).log().norm(), 1e-4);
  EXPECT_LT((bundle.T_map_camera[7].translation() - scene.truth[7].translation()).norm(), 0.01);
}

}  // namespace
}  // namespace hm
