#include "hm/tsdf/grid/grid_query.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/core/rng.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"
#include "hm/tsdf/integration/integrator.hpp"
#include "hm/tsdf/testing/analytic_scene.hpp"

namespace hm {
namespace {

const PinholeCamera kCamera{160, 120, 130, 130, 79.5, 59.5, {}};

TsdfParams fine() {
  TsdfParams params;
  params.voxel_size_m = 0.02;
  return params;
}

/// Grid of a scene integrated from several views around the origin.
VolumeGrid map_of(const AnalyticScene& scene, const std::vector<SE3>& poses) {
  const ParallelLoop loop;
  VolumeGrid grid = Integrator::make_grid(fine());
  Integrator integrator(fine(), DepthNoise(), kCamera, loop);
  for (const SE3& pose : poses) integrator.integrate(grid, scene.render(kCamera, pose));
  return grid;
}

AnalyticScene wall_and_ball() {
  AnalyticScene scene;
  scene.planes.push_back({Vec3(-1, 0, 0), -2.0});  // x = 2, seen from the origin
  scene.balls.push_back({Vec3(1.2, 0, 0), 0.3});
  return scene;
}

TEST(GridQuery, DistanceAndGradientOfAWallAreThoseOfTheAnalyticScene) {
  AnalyticScene wall;
  wall.planes.push_back({Vec3(-1, 0, 0), -2.0});
  const VolumeGrid grid = map_of(wall, {looking_along_x(Vec3::Zero())});
  int known = 0;
  for (double y = -0.5; y <= 0.5; y += 0.037)
    for (double offset_m = -0.02; offset_m <= 0.02; offset_m += 0.0049) {
      const Vec3 p(2.0 - offset_m, y, 0.31 * y);
      const GridSample sample = query_grid(grid, p);
      if (!sample.known) continue;
      ++known;
      EXPECT_NEAR(sample.distance_m, wall.distance(p), 0.003) << p.transpose();
      EXPECT_LT((sample.gradient - Vec3(-1, 0, 0)).norm(), 0.15) << sample.gradient.transpose();
      EXPECT_GT(sample.weight, 0);
    }
  EXPECT_GT(known, 150);
}

TEST(GridQuery, DistancesAroundABallAgreeWithTheAnalyticScene) {
  const AnalyticScene scene = wall_and_ball();
  std::vector<SE3> poses;
  for (const double y : {-0.2, -0.1, 0.0, 0.1, 0.2}) poses.push_back(looking_along_x(Vec3(0, y, y / 2)));
  const VolumeGrid grid = map_of(scene, poses);
  int known = 0;
  for (double angle = -0.5; angle <= 0.5; angle += 0.035)
    for (double offset_m = -0.015; offset_m <= 0.02; offset_m += 0.005) {
      const Vec3 outwards(-std::cos(angle), std::sin(angle), 0);
      const Vec3 p = Vec3(1.2, 0, 0) + (0.3 + offset_m) * outwards;
      const GridSample sample = query_grid(grid, p);
      if (!sample.known) continue;
      ++known;
      // Projective distances are too large by the ray's obliquity to the surface.
      EXPECT_NEAR(sample.distance_m, scene.distance(p), 0.008) << p.transpose();
      EXPECT_GT(sample.gradient.normalized().dot(outwards), 0.8);
    }
  EXPECT_GT(known, 150);
}

TEST(GridQuery, AgreesWithTheGridsOwnSample) {
  const VolumeGrid grid = map_of(wall_and_ball(), {looking_along_x(Vec3::Zero())});
  Rng rng(3);
  const Box3 bounds = grid.bounds();
  int known = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 p =
        bounds.min() + bounds.sizes().cwiseProduct(
                           Vec3(rng.uniform(-0.1, 1.1), rng.uniform(-0.1, 1.1), rng.uniform(-0.1, 1.1)));
    const GridSample sample = query_grid(grid, p);
    const auto wanted = grid.sample(p);
    ASSERT_EQ(sample.known, wanted.has_value());
    if (!wanted) continue;
    ++known;
    EXPECT_EQ(sample.distance_m, wanted->distance_m);
    EXPECT_EQ(sample.gradient, wanted->gradient);
  }
  EXPECT_GT(known, 500);
}

TEST(GridQuery, ColoursAreThoseOfTheSurface) {
  AnalyticScene wall;
  wall.planes.push_back({Vec3(-1, 0, 0), -2.0});
  const VolumeGrid grid = map_of(wall, {looking_along_x(Vec3::Zero())});
  int colored = 0;
  for (double y = -0.5; y <= 0.5; y += 0.05) {
    const GridSample sample = query_grid(grid, Vec3(2.0, y, 0.1));
    if (!sample.known || !sample.color) continue;
    ++colored;
    EXPECT_NEAR(sample.color->g, 127.5 + 127.0 * std::sin(3 * y), 12);  // colour pattern of AnalyticScene
    EXPECT_NEAR(sample.color->b, 127.5 + 127.0 * std::sin(0.3), 12);
  }
  EXPECT_GT(colored, 15);
}

TEST(GridQuery, SaysWhereNothingIsKnown) {
  const VolumeGrid grid = map_of(wall_and_ball(), {looking_along_x(Vec3::Zero())});
  const double infinite = std::numeric_limits<double>::infinity();
  for (const Vec3& p :
       {Vec3(-1, 0, 0), Vec3(2.5, 0, 0), Vec3(1e12, 0, 0), Vec3(-infinite, 0, 0), Vec3(0, std::nan(""), 0)}) {
    const GridSample sample = query_grid(grid, p);
    EXPECT_FALSE(sample.known) << p.transpose();
    EXPECT_FALSE(sample.color);
    EXPECT_EQ(sample.weight, 0);
  }
}

TEST(GridQuery, ManyPointsAtOnceGiveTheSameOnAnyNumberOfThreads) {
  VolumeGrid grid = map_of(wall_and_ball(), {looking_along_x(Vec3::Zero())});
  for (const VolumeKey& key : grid.sorted_keys()) grid.pack(key);  // every look-up has to unpack
  std::vector<Vec3> points;
  Rng rng(5);
  for (int i = 0; i < 30000; ++i)
    points.emplace_back(rng.uniform(0.5, 2.2), rng.uniform(-1, 1), rng.uniform(-1, 1));
  std::vector<GridSample> samples(points.size());
  query_grid(grid, points, samples, ParallelLoop(4));
  int known = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const GridSample alone = query_grid(grid, points[i]);
    ASSERT_EQ(samples[i].known, alone.known);
    known += alone.known ? 1 : 0;
    EXPECT_EQ(samples[i].distance_m, alone.distance_m);
    EXPECT_EQ(samples[i].gradient, alone.gradient);
    EXPECT_EQ(samples[i].weight, alone.weight);
    EXPECT_EQ(samples[i].color, alone.color);
  }
  EXPECT_GT(known, 500);
}

}  // namespace
}  // namespace hm
