#include "hm/odometry/tracker/window_adjustment.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "hm/odometry/testing/point_scenes.hpp"

namespace hm {
namespace {

const PinholeCamera kWindowCamera{640, 480, 525, 525, 319.5, 239.5, {}};

struct World {
  std::vector<SE3> poses;
  std::vector<Vec3> points;
};

World make_world(Rng& rng, std::size_t keyframes) {
  World world;
  for (std::size_t k = 0; k < keyframes; ++k) {
    const double t = static_cast<double>(k);
    world.poses.emplace_back(so3_exp(Vec3(0.02 * t, -0.03 * t, 0.01 * t)),
                             Vec3(0.08 * t, 0.02 * t, 0.03 * t));
  }
  for (int i = 0; i < 120; ++i) world.points.push_back(point_in_view(rng) + Vec3(0.2, 0, 0.4));
  return world;
}

struct Errors {
  double pose_m = 0, pose_rad = 0, pixel_px = 0, depth_m = 0;
};

/// Map of the world with wrong poses and points, and noisy sightings.
LocalMap make_map(const World& world, const Errors& errors, Rng& rng) {
  LocalMap map(10000, 100);
  for (std::size_t k = 0; k < world.poses.size(); ++k) {
    MapKeyframe keyframe;
    keyframe.T_odom_camera = world.poses[k];
    if (k > 0)
      keyframe.T_odom_camera = keyframe.T_odom_camera * random_motion(rng, errors.pose_m, errors.pose_rad);
    MapKeyframe& added = map.add_keyframe(std::move(keyframe));
    for (std::size_t i = 0; i < world.points.size(); ++i) {
      const Vec3 p = world.poses[k].inverse() * world.points[i];
      const double dx = rng.normal(0, errors.pixel_px), dy = rng.normal(0, errors.pixel_px);
      const Vec2 pixel = kWindowCamera.project(p) + Vec2(dx, dy);
      const double depth_m = p.z() + rng.normal(0, errors.depth_m);
      if (k == 0) {
        MapLandmark landmark;
        landmark.p_odom = added.T_odom_camera * kWindowCamera.unproject(pixel, depth_m);
        landmark.anchor = added.identity;
        EXPECT_EQ(map.add_landmark(landmark), i);
      }
      added.sightings.push_back({i, pixel, Mat2::Identity() * 0.09, i % 4 == 0 ? 0 : depth_m, 1e-4});
      map.landmark(i).sightings += 1;
    }
  }
  return map;
}

double worst_pose_error_m(const LocalMap& map, const World& world) {
  double worst = 0;
  for (std::size_t k = 0; k < world.poses.size(); ++k)
    worst = std::max(worst, (map.keyframes()[k].T_odom_camera.inverse() * world.poses[k]).log().norm());
  return worst;
}

TEST(WindowAdjustment, FindsTheTruthExactlyWithoutNoise) {
  Rng rng(1);
  const World world = make_world(rng, 6);
  LocalMap map = make_map(world, {0.03, 0.02, 0, 0}, rng);
  const auto result = adjust_window(map, kWindowCamera, {10, 30});
  EXPECT_LT(result.cost_after, 1e-6 * result.cost_before);
  EXPECT_LT(worst_pose_error_m(map, world), 1e-4);
  for (std::size_t i = 0; i < world.points.size(); ++i)
    EXPECT_LT((map.landmark(i).p_odom - world.points[i]).norm(), 1e-4);
}

TEST(WindowAdjustment, IsBetterThanWhatItBeganWithAndNeverWorseInCost) {
  Rng rng(2);
  for (int trial = 0; trial < 5; ++trial) {
    const World world = make_world(rng, 8);
    LocalMap map = make_map(world, {0.02, 0.01, 0.3, 0.01}, rng);
    const double before = worst_pose_error_m(map, world);
    const auto result = adjust_window(map, kWindowCamera, {10, 20});
    EXPECT_LE(result.cost_after, result.cost_before);
    EXPECT_LT(worst_pose_error_m(map, world), 0.25 * before);
    EXPECT_LT(worst_pose_error_m(map, world), 0.006);
  }
}

TEST(WindowAdjustment, OnlyTheNewestKeyframesMove) {
  Rng rng(3);
  const World world = make_world(rng, 8);
  LocalMap map = make_map(world, {0.02, 0.01, 0.3, 0.01}, rng);
  std::vector<Mat4> before;
  for (const MapKeyframe& keyframe : map.keyframes()) before.push_back(keyframe.T_odom_camera.matrix());
  adjust_window(map, kWindowCamera, {3, 5});
  for (std::size_t k = 0; k < 8; ++k)
    EXPECT_EQ(map.keyframes()[k].T_odom_camera.matrix() == before[k], k < 5) << k;
}

/// A damped step must not depend on the axes of odom; tested after two steps, before convergence.
TEST(WindowAdjustment, DoesNotDependOnTheAxesOfOdom) {
  Rng rng(12);
  const World world = make_world(rng, 6);
  LocalMap map = make_map(world, {0.03, 0.02, 0.5, 0.02}, rng);
  LocalMap moved = map;
  const SE3 T = random_motion(rng, 2.0, 2.0);
  for (MapKeyframe& keyframe : moved.keyframes()) keyframe.T_odom_camera = T * keyframe.T_odom_camera;
  for (std::size_t i = 0; i < world.points.size(); ++i)
    moved.landmark(i).p_odom = T * moved.landmark(i).p_odom;
  adjust_window(map, kWindowCamera, {10, 2});
  adjust_window(moved, kWindowCamera, {10, 2});
  for (std::size_t k = 0; k < world.poses.size(); ++k)
    EXPECT_LT(
        ((T * map.keyframes()[k].T_odom_camera).inverse() * moved.keyframes()[k].T_odom_camera).log().norm(),
        1e-9);
  for (std::size_t i = 0; i < world.points.size(); ++i)
    EXPECT_LT((T * map.landmark(i).p_odom - moved.landmark(i).p_odom).norm(), 1e-8);
}

TEST(WindowAdjustment, OutliersDoNotPull) {
  Rng rng(4);
  const World world = make_world(rng, 6);
  LocalMap map = make_map(world, {0.01, 0.005, 0.2, 0.005}, rng);
  for (MapKeyframe& keyframe : map.keyframes())
    for (std::size_t i = 0; i < keyframe.sightings.size(); i += 5)
      keyframe.sightings[i].pixel.x() += rng.uniform(-40, 40);
  adjust_window(map, kWindowCamera, {10, 30});
  EXPECT_LT(worst_pose_error_m(map, world), 0.006);
}

/// Sightings five times more accurate than their covariances, some of them displaced by their standard
/// deviation, in opposite directions in every other keyframe: they are detected as outliers relative to the
/// others.
TEST(WindowAdjustment, OutliersAreMeasuredByWhatTheOthersDo) {
  double sum_m = 0;
  for (std::uint64_t seed = 6; seed < 10; ++seed) {
    Rng rng(seed);
    const World world = make_world(rng, 6);
    LocalMap map = make_map(world, {0.0004, 0.0001, 0.06, 0.002}, rng);
    for (std::size_t k = 0; k < world.poses.size(); ++k)
      for (Sighting& sighting : map.keyframes()[k].sightings)
        if (rng.uniform() < 0.2) sighting.pixel.x() += k % 2 == 0 ? 1 : -1;
    adjust_window(map, kWindowCamera, {10, 30});
    sum_m += worst_pose_error_m(map, world);
  }
  EXPECT_LT(sum_m / 4, 0.0005);
}

/// A single factor must move the pose to its linearisation point minus its gradient step.
TEST(WindowAdjustment, SurfaceFactorsHoldTheirMotion) {
  Rng rng(5);
  LocalMap map(100, 100);
  const SE3 T_a = random_motion(rng, 1, 0.5), T_ab = random_motion(rng, 0.3, 0.2);
  MapKeyframe a, b;
  a.T_odom_camera = T_a;
  const std::size_t identity = map.add_keyframe(std::move(a)).identity;
  b.T_odom_camera = T_a * T_ab * random_motion(rng, 0.02, 0.02);
  SurfaceFactor factor{identity, T_ab, Mat6::Identity() * 1e4, Vec6::Zero()};
  factor.gradient[0] = -1e4 * 0.003;
  b.factors.push_back(factor);
  map.add_keyframe(std::move(b));
  adjust_window(map, kWindowCamera, {5, 30});
  const SE3 expected = T_a * T_ab * SE3::exp(0.003 * Vec6::Unit(0));
  EXPECT_LT((map.keyframes()[1].T_odom_camera.inverse() * expected).log().norm(), 1e-5);
}

TEST(WindowAdjustment, SmallMapsAreLeftAlone) {
  LocalMap map(100, 100);
  EXPECT_EQ(adjust_window(map, kWindowCamera, {}).accepted_steps, 0);
  map.add_keyframe({});
  EXPECT_EQ(adjust_window(map, kWindowCamera, {}).accepted_steps, 0);
  map.add_keyframe({});
  EXPECT_EQ(adjust_window(map, kWindowCamera, {}).cost_after, 0);
}

}  // namespace
}  // namespace hm
