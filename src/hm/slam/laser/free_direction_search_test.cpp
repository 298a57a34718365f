#include "hm/slam/laser/free_direction_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hm/laser/testing/planar_world.hpp"

namespace hm {
namespace {

using laser_testing::PlanarWorld;

constexpr laser_testing::TestLaser kHalfCircle{181, std::numbers::pi, 80, 0.01};
constexpr double kCorridor_m = 80;

/// A corridor along x, 2.4 m wide; doors stand back by `niche_m` at uneven distances on both sides.
PlanarWorld corridor(double niche_m) {
  PlanarWorld world;
  Rng rng(5);
  for (const double side : {-1.0, 1.0}) {
    std::vector<Vec2> corners{{-10, side * 1.2}};
    for (double x = -9; x < kCorridor_m; x += 2 + 4 * rng.uniform())
      for (const auto& [along, back] : {std::pair{0.0, 0.0}, {0.0, niche_m}, {0.95, niche_m}, {0.95, 0.0}})
        corners.emplace_back(x + along, side * (1.2 + back));
    corners.emplace_back(kCorridor_m + 10, side * 1.2);
    for (std::size_t i = 1; i < corners.size(); ++i) world.segments.push_back({corners[i - 1], corners[i]});
  }
  return world;
}

PlanarScan scan_at(const PlanarWorld& world, double x_m, Rng& rng) {
  return planar_scan_of_world(world, SE2(x_m, 0, 0), kHalfCircle, rng);
}

FreeDirectionSearch search_after(const PlanarWorld& world, double until_m, Rng& rng) {
  FreeDirectionSearch search;
  for (double x = until_m - 4; x <= until_m; x += 0.16) search.add(scan_at(world, x, rng), SE2(x, 0, 0));
  return search;
}

TEST(FreeDirectionSearch, DoorsThatStandBackTellTheShift) {
  const PlanarWorld world = corridor(0.12);
  Rng rng(1);
  for (const double at_m : {10.0, 20.0, 30.0}) {
    FreeDirectionSearch search = search_after(world, at_m, rng);
    for (const double error_m : {-0.12, 0.0, 0.12}) {
      const PlanarScan scan = scan_at(world, at_m + 0.2, rng);
      const auto found = search.find(scan, SE2(at_m + 0.2 + error_m, 0, 0), Vec2(1, 0), 0.4);
      ASSERT_TRUE(found);
      EXPECT_NEAR(found->shift_m, -error_m, 0.04) << at_m;
      EXPECT_LT(found->sigma_m, 0.06);
    }
  }
}

/// Between bare walls the prediction counts, and its deviation; the places before are no better ones.
TEST(FreeDirectionSearch, BareWallsDoNotHoldTheVehicleBack) {
  const PlanarWorld world = corridor(0);
  Rng rng(2);
  FreeDirectionSearch search = search_after(world, 20, rng);
  for (const double ahead_m : {0.1, 0.3, 0.5}) {
    const auto found =
        search.find(scan_at(world, 20 + ahead_m, rng), SE2(20 + ahead_m, 0, 0), Vec2(1, 0), 0.3);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->shift_m, 0, 0.03) << ahead_m;
    EXPECT_GT(found->sigma_m, 0.08);
  }
}

TEST(FreeDirectionSearch, SaysNothingWithoutWalls) {
  const PlanarWorld world = corridor(0.12);
  Rng rng(3);
  FreeDirectionSearch empty;
  EXPECT_FALSE(empty.find(scan_at(world, 10, rng), SE2(10, 0, 0), Vec2(1, 0), 0.2));
  FreeDirectionSearch search = search_after(world, 10, rng);
  EXPECT_FALSE(search.find({}, SE2(10, 0, 0), Vec2(1, 0), 0.2));
  search.clear();
  EXPECT_FALSE(search.find(scan_at(world, 10, rng), SE2(10, 0, 0), Vec2(1, 0), 0.2));
}

/// Length that odometry without wheels measures along the corridor, by a vehicle that goes 0.8 m/s, and
/// slower now and then.
double measured_m(bool finds_along, double& driven_m) {
  const PlanarWorld world = corridor(0.12);
  Rng rng(4);
  ScanOdometry odometry;
  FreeDirectionSearch search;
  MotionPrediction prediction;
  if (finds_along)
    prediction.find_along = [&](const PlanarScan& scan, const SE2& T_odom_base, const Vec2& direction,
                                double elapsed_s) {
      return search.find(scan, T_odom_base, direction, elapsed_s);
    };
  double x_m = 0, speed_m_s = 0, last_m = 0;
  for (int i = 0; x_m < kCorridor_m - 15; ++i) {
    const double wanted_m_s = i / 50 % 3 == 2 ? 0.4 : 0.8;
    speed_m_s += std::clamp(wanted_m_s - speed_m_s, -0.1, 0.1);
    x_m += 0.2 * speed_m_s;
    PlanarScan scan = scan_at(world, x_m, rng);
    scan.stamp = Time::from_seconds(0.2 * i);
    const OdometryStep step = odometry.process(scan, prediction);
    if (!step.T_odom_base) continue;
    last_m = step.T_odom_base->translation().x();
    search.add(scan, *step.T_odom_base);
  }
  driven_m = x_m - 0.02;  // the first scan is at 0.02 m
  return last_m;
}

TEST(FreeDirectionSearch, OdometryAlongACorridorKeepsItsLength) {
  double driven_m = 0;
  EXPECT_GT(std::abs(measured_m(false, driven_m) - driven_m), 1.5);
  EXPECT_LT(std::abs(measured_m(true, driven_m) - driven_m), 0.5);
}

}  // namespace
}  // namespace hm
