#include "hm/slam/laser/motion/free_direction_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hm/laser/testing/planar_world.hpp"

namespace hm {
namespace {

using laser_testing::corridor_world, laser_testing::PlanarWorld, laser_testing::TestLaser;

constexpr TestLaser kHalfCircle{181, std::numbers::pi, 80, 0.01};
constexpr double kCorridor_m = 80;

PlanarScan scan_at(const PlanarWorld& world, double x_m, Rng& rng) {
  return planar_scan_of_world(world, SE2(x_m, 0, 0), kHalfCircle, rng);
}

FreeDirectionSearch search_after(const PlanarWorld& world, double until_m, Rng& rng) {
  FreeDirectionSearch search;
  for (double x = until_m - 4; x <= until_m; x += 0.16) search.add(scan_at(world, x, rng), SE2(x, 0, 0));
  return search;
}

TEST(FreeDirectionSearch, DoorsThatStandBackTellTheShift) {
  const PlanarWorld world = corridor_world(kCorridor_m, 0.12);
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
  const PlanarWorld world = corridor_world(kCorridor_m, 0);
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
  const PlanarWorld world = corridor_world(kCorridor_m, 0.12);
  Rng rng(3);
  FreeDirectionSearch empty;
  EXPECT_FALSE(empty.find(scan_at(world, 10, rng), SE2(10, 0, 0), Vec2(1, 0), 0.2));
  FreeDirectionSearch search = search_after(world, 10, rng);
  EXPECT_FALSE(search.find({}, SE2(10, 0, 0), Vec2(1, 0), 0.2));
  search.clear();
  EXPECT_FALSE(search.find(scan_at(world, 10, rng), SE2(10, 0, 0), Vec2(1, 0), 0.2));
}

/// Scores between bare walls differ by little and to one side. That is no reason to slow down.
TEST(FreeDirectionSearch, BareWallsLeaveTheVelocityAlone) {
  const PlanarWorld world = corridor_world(kCorridor_m, 0);
  Rng rng(2);
  FreeDirectionSearch search = search_after(world, 20, rng);
  double sum_m = 0;
  for (int i = 0; i < 50; ++i)
    sum_m += search.find(scan_at(world, 20.2, rng), SE2(20.2, 0, 0), Vec2(1, 0), 0.06)->shift_m;
  EXPECT_LT(std::abs(sum_m), 50 * 0.0005);
}

/// Error of the length that odometry without wheels measures along the corridor, by a vehicle that goes
/// 0.8 m/s, and slower now and then.
double length_error_m(bool finds_along, const TestLaser& laser, double scans_per_s) {
  const PlanarWorld world = corridor_world(kCorridor_m, 0.12);
  Rng rng(4);
  ScanOdometry odometry;
  FreeDirectionSearch search;
  MotionPrediction prediction;
  if (finds_along)
    prediction.find_along = [&](const PlanarScan& scan, const SE2& T_odom_base, const Vec2& direction,
                                double predicted_sigma_m) {
      return search.find(scan, T_odom_base, direction, predicted_sigma_m);
    };
  const double dt_s = 1 / scans_per_s;
  double x_m = 0, speed_m_s = 0, first_m = 0, last_m = 0;
  for (int i = 0; x_m < kCorridor_m - 15; ++i) {
    const double wanted_m_s = static_cast<int>(i * dt_s / 10) % 3 == 2 ? 0.4 : 0.8;
    speed_m_s += std::clamp(wanted_m_s - speed_m_s, -0.5 * dt_s, 0.5 * dt_s);
    x_m += dt_s * speed_m_s;
    if (i == 0) first_m = x_m;
    PlanarScan scan = planar_scan_of_world(world, SE2(x_m, 0, 0), laser, rng);
    scan.stamp = Time::from_seconds(i * dt_s);
    const OdometryStep step = odometry.process(scan, prediction);
    if (!step.T_odom_base) continue;
    last_m = step.T_odom_base->translation().x();
    search.add(scan, *step.T_odom_base);
  }
  return std::abs(last_m - (x_m - first_m));
}

/// At any rate, and with any number of beams.
TEST(FreeDirectionSearch, OdometryAlongACorridorKeepsItsLength) {
  constexpr TestLaser kNear{181, std::numbers::pi, 12, 0.01}, kFine{1081, 1.5 * std::numbers::pi, 12, 0.01};
  EXPECT_GT(length_error_m(false, kHalfCircle, 5), 1.5);
  for (const auto& [laser, scans_per_s] :
       {std::pair{kHalfCircle, 5.0}, {kNear, 10.0}, {kNear, 40.0}, {kFine, 20.0}})
    EXPECT_LT(length_error_m(true, laser, scans_per_s), 0.5) << laser.beams << " " << scans_per_s;
}

}  // namespace
}  // namespace hm
