#include "hm/slam/laser/grid_localiser.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/laser/testing/planar_world.hpp"

namespace hm {
namespace {

using namespace laser_testing;

const TestLaser kLaser{361, 4.71, 30, 0.01};

/// Walls of a world on a grid of 5 cm, from its scans.
OccupancyGrid2D grid_of(const PlanarWorld& world, const std::vector<SE2>& poses) {
  OccupancyGrid2D grid;
  grid.resolution_m = 0.05;
  grid.origin_m = {-4, -6};
  grid.cells = Image<std::uint8_t>(520, 480, OccupancyGrid2D::kUnknown);
  Rng rng(1);
  for (const SE2& pose : poses)
    for (const Vec2& point : planar_scan_of_world(world, pose, {1081, 6.2, 30, 0}, rng).points_m) {
      const Vec2 at = pose * point;
      if (grid.cells.contains(grid.column_of(at.x()), grid.row_of(at.y())))
        grid.cells(grid.column_of(at.x()), grid.row_of(at.y())) = 100;
    }
  return grid;
}

std::vector<SE2> round_trip() {
  std::vector<SE2> poses;
  for (double at_m = 0; at_m < kOfficeLoop_m; at_m += 0.4) poses.push_back(office_loop(at_m));
  return poses;
}

TEST(GridLocaliser, FindsItsPlaceAndFollows) {
  const PlanarWorld world = office_world();
  GridLocaliser localiser(grid_of(world, round_trip()));
  Rng rng(2);
  for (const double begin_m : {3.0, 17.0, 30.0}) {
    localiser.reset();
    SE2 last = office_loop(begin_m);
    for (int i = 0; i < 40; ++i) {
      const SE2 truth = office_loop(begin_m + 0.1 * i);
      const SE2 motion =
          (last.inverse() * truth) * SE2(rng.normal(0, 0.02), rng.normal(0, 0.02), rng.normal(0, 0.02));
      last = truth;
      const Localisation found = localiser.process(planar_scan_of_world(world, truth, kLaser, rng), motion);
      ASSERT_EQ(found.status, i == 0 ? LocalisationStatus::kLocalised : LocalisationStatus::kTracking)
          << begin_m << " " << i << " " << to_string(found.status);
      EXPECT_LT((found.T_map_base->translation() - truth.translation()).norm(), 0.05);
      EXPECT_LT(std::abs((found.T_map_base->inverse() * truth).angle()), 0.01);
    }
  }
}

/// A rectangle looks the same from two opposite poses.
TEST(GridLocaliser, SymmetryIsAmbiguous) {
  PlanarWorld world;
  world.add_box({0, 0}, {8, 5});
  GridLocaliser localiser(grid_of(world, {SE2(3, 2, 0)}));
  Rng rng(3);
  const PlanarScan scan = planar_scan_of_world(world, SE2(3, 1.5, 0.3), {361, 6.2, 30, 0.01}, rng);
  EXPECT_EQ(localiser.process(scan).status, LocalisationStatus::kAmbiguous);
  // With a given start pose, tracking works.
  localiser.start(SE2(3.05, 1.45, 0.28));
  const Localisation found = localiser.process(scan);
  ASSERT_EQ(found.status, LocalisationStatus::kTracking);
  EXPECT_LT((found.T_map_base->translation() - Vec2(3, 1.5)).norm(), 0.05);
}

TEST(GridLocaliser, ElsewhereIsNotFoundAndGetsLost) {
  const PlanarWorld world = office_world(), other = room_world();
  GridLocaliserParams params;
  params.max_failures = 3;
  GridLocaliser localiser(grid_of(world, round_trip()), params);
  Rng rng(4);
  localiser.start(office_loop(3));
  PlanarScan strange;  // a spiral: does not match anything in the office
  for (int i = 0; i < 200; ++i)
    strange.points_m.push_back((0.5 + 0.012 * i) * Vec2(std::cos(0.031 * i), std::sin(0.031 * i)));
  sort_by_bearing(strange);
  EXPECT_EQ(localiser.process(strange).status, LocalisationStatus::kMatchFailed);
  EXPECT_EQ(localiser.process(strange).status, LocalisationStatus::kMatchFailed);
  EXPECT_EQ(localiser.process(strange).status, LocalisationStatus::kLost);
  EXPECT_EQ(localiser.process(strange).status, LocalisationStatus::kNotFound);
  // Back in the office it is localised again.
  const Localisation found = localiser.process(planar_scan_of_world(world, office_loop(20), kLaser, rng));
  ASSERT_EQ(found.status, LocalisationStatus::kLocalised);
  EXPECT_LT((found.T_map_base->translation() - office_loop(20).translation()).norm(), 0.05);
}

TEST(GridLocaliser, NothingToGoBy) {
  OccupancyGrid2D empty;
  Rng rng(5);
  const PlanarScan scan = planar_scan_of_world(room_world(), SE2(), kLaser, rng);
  EXPECT_EQ(GridLocaliser(empty).process(scan).status, LocalisationStatus::kEmptyMap);
  GridLocaliser localiser(grid_of(room_world(), {SE2()}));
  EXPECT_EQ(localiser.process({}).status, LocalisationStatus::kTooFewPoints);
  GridLocaliserParams params;
  params.global_max_evaluations = 1000;
  EXPECT_EQ(GridLocaliser(grid_of(room_world(), {SE2()}), params).process(scan).status,
            LocalisationStatus::kLimitReached);
}

}  // namespace
}  // namespace hm
