#include "hm/slam/laser/motion/motion_search.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/laser/testing/planar_world.hpp"

namespace hm {
namespace {

using namespace laser_testing;

const TestLaser kHalfTurn{181, 3.14159, 30, 0.01};

double turn_between(const SE2& a, const SE2& b) { return std::abs((a.inverse() * b).angle()); }

/// Last scans of a path through the office.
MotionSearch after_a_drive(const PlanarWorld& world, double end_m, Rng& rng) {
  MotionSearch search;
  for (double at_m = end_m - 4; at_m <= end_m; at_m += 0.1)
    search.add(planar_scan_of_world(world, office_loop(at_m), kHalfTurn, rng), office_loop(at_m));
  return search;
}

TEST(MotionSearch, FindsAScanThatIsTurnedAndMovedFarFromThePrediction) {
  const PlanarWorld world = office_world();
  Rng rng(1);
  for (const double at_m : {6.0, 15.0, 27.0, 36.0}) {
    MotionSearch search = after_a_drive(world, at_m, rng);
    for (const double turn_rad : {-1.0, -0.4, 0.6, 1.1}) {
      const SE2 truth = office_loop(at_m) * SE2(0.25, -0.1, turn_rad);
      const auto found = search.find(planar_scan_of_world(world, truth, kHalfTurn, rng), {office_loop(at_m)});
      ASSERT_TRUE(found) << at_m << " " << turn_rad;
      EXPECT_LT((found->T_odom_base.translation() - truth.translation()).norm(), 0.04) << at_m << turn_rad;
      EXPECT_LT(turn_between(found->T_odom_base, truth), 0.015) << at_m << " " << turn_rad;
      EXPECT_GT(found->covariance.trace(), 0);
    }
  }
}

TEST(MotionSearch, WhatWasNeverSeenIsNotFound) {
  const PlanarWorld office = office_world(), room = room_world();
  Rng rng(2);
  MotionSearch search = after_a_drive(office, 12, rng);
  EXPECT_FALSE(search.find(planar_scan_of_world(room, SE2(1, 0.5, 0.7), kHalfTurn, rng), {office_loop(12)}));
  EXPECT_FALSE(search.find(PlanarScan{}, {office_loop(12)}));
  search.clear();
  EXPECT_FALSE(search.find(planar_scan_of_world(office, office_loop(12), kHalfTurn, rng), {office_loop(12)}));
}

/// A square room looks the same after each quarter turn: the less time has passed, the smaller the rotation.
TEST(MotionSearch, OfEqualPlacesTheOneNearThePredictionCounts) {
  PlanarWorld world;
  world.add_box({-2, -2}, {2, 2});
  const TestLaser laser{361, 6.28, 30, 0.005};
  Rng rng(3);
  MotionSearch search;
  search.add(planar_scan_of_world(world, SE2(), laser, rng), SE2());
  for (const double predicted_rad : {-1.5, 0.1, 1.6, 3.1}) {
    const auto found =
        search.find(planar_scan_of_world(world, SE2(), laser, rng), {SE2(0, 0, predicted_rad)});
    ASSERT_TRUE(found);
    EXPECT_LT(turn_between(found->T_odom_base, SE2(0, 0, predicted_rad)), 0.15) << predicted_rad;
    EXPECT_GT(found->covariance(2, 2), 0.1);  // another place rivals this one
  }
}

/// Along a corridor a scan fits everywhere: it stays where wheels predict it. Across, and in heading, the
/// walls count.
TEST(MotionSearch, AlongACorridorWheelsCount) {
  PlanarWorld world;
  world.segments = {{{-80, -1}, {80, -1}}, {{-80, 1}, {80, 1}}};
  const TestLaser laser{181, 3.14159, 20, 0.01};
  const Mat3 covariance = Vec3(0.01, 0.01, 0.01).asDiagonal();
  Rng rng(6);
  MotionSearch search;
  for (int i = 0; i < 4; ++i) {
    const SE2 pose(0.7 * i, 0, 0);
    search.add(planar_scan_of_world(world, pose, laser, rng), pose);
  }
  for (const double along_m : {2.4, 2.87, 3.31}) {
    const SE2 predicted(along_m, 0.12, -0.11);
    const auto found =
        search.find(planar_scan_of_world(world, SE2(3, 0, 0), laser, rng), {predicted, 0.6, 1, covariance});
    ASSERT_TRUE(found) << along_m;
    EXPECT_NEAR(found->T_odom_base.x(), along_m, 0.03);
    EXPECT_NEAR(found->T_odom_base.y(), 0, 0.03);
    EXPECT_NEAR(found->T_odom_base.angle(), 0, 0.02);
  }
}

TEST(MotionSearch, AfterFailuresItLooksFurther) {
  const PlanarWorld world = office_world();
  Rng rng(4);
  MotionSearch search = after_a_drive(world, 12, rng);
  const SE2 truth = office_loop(12);
  const SE2 predicted = truth * SE2(-3.5, 0, 0.3);  // beyond the first window of 1.4 m
  const PlanarScan scan = planar_scan_of_world(world, truth, kHalfTurn, rng);
  int tries = 1;
  std::optional<FoundScan> found = search.find(scan, {predicted, 4, 3});
  while ((!found || (found->T_odom_base.translation() - truth.translation()).norm() > 0.1) && ++tries < 6)
    found = search.find(scan, {predicted, 4, 3});
  EXPECT_GT(tries, 1);
  ASSERT_TRUE(found);
  EXPECT_LT((found->T_odom_base.translation() - truth.translation()).norm(), 0.04);
}

/// Half a turn later a laser that sees half of the surroundings shares little with any earlier scan; what it
/// sees at the true pose agrees all the same, and what it would see elsewhere does not.
TEST(MotionSearch, AgreementTellsTheTruePoseFromOthers) {
  const PlanarWorld world = office_world();
  Rng rng(5);
  const MotionSearch search = after_a_drive(world, 15, rng);
  for (const double turn_rad : {0.0, 0.8, 2.0, 3.0}) {
    const SE2 truth = office_loop(15) * SE2(0.1, 0, turn_rad);
    const PlanarScan scan = planar_scan_of_world(world, truth, kHalfTurn, rng);
    EXPECT_TRUE(search.agrees(scan, truth)) << turn_rad;
    EXPECT_FALSE(search.agrees(scan, truth * SE2(0.6, 0.3, 0.2))) << turn_rad;
    EXPECT_FALSE(search.agrees(scan, truth * SE2(0, 0, 0.4))) << turn_rad;
  }
  EXPECT_TRUE(MotionSearch().agrees(planar_scan_of_world(world, SE2(), kHalfTurn, rng), SE2()));
}

}  // namespace
}  // namespace hm
