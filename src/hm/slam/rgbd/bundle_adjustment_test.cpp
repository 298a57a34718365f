#include "hm/slam/rgbd/bundle_adjustment.hpp"

#include <gtest/gtest.h>

#include <cmath>

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

/// Keyframes around a point cloud, their features linked by the points they are of.
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
  std::vector<std::vector<std::uint32_t>> owner;  // of each keyframe's features: the point
  for (int i = 0; i < 8; ++i) {
    scene.truth.push_back(test::level_camera(0.25 * i, 0.1 * std::sin(i), 0.05 * std::cos(i)));
    Keyframe keyframe;
    keyframe.features = test::see(world, scene.truth.back(), rng, {0.7, 0.0014, 0, 4.5, 1000});
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

double error_of(const std::vector<SE3>& poses, const std::vector<SE3>& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < poses.size(); ++i)
    sum += (poses[i].translation() - truth[i].translation()).squaredNorm();
  return std::sqrt(sum / static_cast<double>(poses.size()));
}

TEST(BundleAdjustment, BringsKeyframesToTheirPlaces) {
  Scene scene = make_scene(2, 0.02);
  std::vector<SE3> poses = scene.disturbed;
  std::vector<Landmark> landmarks = make_landmarks(scene.pointers, poses, scene.links);
  ASSERT_GT(landmarks.size(), 100U);
  const std::size_t first[] = {0};
  const BundleResult result = adjust_bundle(test::landmark_camera(), poses, landmarks, first);
  EXPECT_TRUE(result.converged) << result.message;
  EXPECT_GT(error_of(scene.disturbed, scene.truth), 0.02);
  EXPECT_LT(error_of(poses, scene.truth), 0.004);
  EXPECT_LT(result.final_cost, result.initial_cost);
  EXPECT_GT(result.error_before_px, 3);
  EXPECT_NEAR(result.error_after_px, 0.7 * std::sqrt(2.0), 0.25);  // the noise of a pixel, in two directions
  EXPECT_EQ(poses[0].matrix(), scene.truth[0].matrix());
}

/// Every fiftieth link is a lie, which the loss must bear; ambiguous landmarks are left out.
TEST(BundleAdjustment, BearsWrongLinks) {
  Scene scene = make_scene(3, 0.01, 0.02);
  std::vector<SE3> poses = scene.disturbed;
  std::vector<Landmark> landmarks = make_landmarks(scene.pointers, poses, scene.links);
  for (const Landmark& landmark : landmarks)
    for (std::size_t i = 1; i < landmark.observations.size(); ++i)
      EXPECT_LT(landmark.observations[i - 1].keyframe, landmark.observations[i].keyframe);
  const std::size_t first[] = {0};
  EXPECT_TRUE(adjust_bundle(test::landmark_camera(), poses, landmarks, first).converged);
  EXPECT_LT(error_of(poses, scene.truth), 0.01);
}

TEST(BundleAdjustment, DeterministicAndDegenerate) {
  Scene scene = make_scene(4, 0.02);
  std::vector<SE3> poses = scene.disturbed, again = scene.disturbed;
  std::vector<Landmark> landmarks = make_landmarks(scene.pointers, poses, scene.links), same = landmarks;
  const std::size_t first[] = {0};
  adjust_bundle(test::landmark_camera(), poses, landmarks, first);
  adjust_bundle(test::landmark_camera(), again, same, first);
  for (std::size_t i = 0; i < poses.size(); ++i) EXPECT_EQ(poses[i].matrix(), again[i].matrix());
  std::vector<Landmark> none;
  EXPECT_FALSE(adjust_bundle(test::landmark_camera(), poses, none, first).converged);
  EXPECT_TRUE(make_landmarks(scene.pointers, poses, {}).empty());
  // Two features of one keyframe in one landmark: nobody knows which it is.
  const FeatureLink twice[] = {{0, 1, 1, 1}, {0, 2, 1, 1}};
  EXPECT_TRUE(make_landmarks(scene.pointers, poses, twice).empty());
  // Without depth in any of its keyframes a landmark has no place.
  for (Keyframe& keyframe : scene.keyframes)
    for (Feature& feature : keyframe.features) feature.has_depth = false;
  EXPECT_TRUE(make_landmarks(scene.pointers, poses, scene.links).empty());
}

}  // namespace
}  // namespace hm
