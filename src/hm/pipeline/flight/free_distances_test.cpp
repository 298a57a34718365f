#include "hm/pipeline/flight/free_distances.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace hm {
namespace {

constexpr double kPi = std::numbers::pi;

/// A scan of 1081 beams (270 degrees) in the middle of a square room; `gap_m`: half width of a gap in the
/// wall ahead.
LaserScan scan_in_room(double wall_m, double gap_m = 0) {
  LaserScan scan;
  scan.angle_min_rad = -0.75 * kPi;
  scan.angle_increment_rad = 1.5 * kPi / 1080;
  scan.range_min_m = 0.05;
  scan.range_max_m = 30;
  for (std::size_t i = 0; i < 1081; ++i) {
    const double angle = scan.angle_rad(i), c = std::cos(angle), s = std::sin(angle);
    double range_m = wall_m / std::max(std::abs(c), std::abs(s));
    if (c > std::abs(s) && std::abs(range_m * s) < gap_m) range_m = 20;
    scan.ranges_m.push_back(static_cast<float>(range_m));
  }
  return scan;
}

HullPose level_hull() { return {0, 0, 1.2, 0.34}; }

TEST(FreeDistances, AreThoseToTheWallsAlongEachAxis) {
  const FreeDistances free = free_distances(scan_in_room(2), {}, level_hull());
  for (const double angle : {0.0, 0.5 * kPi, -0.5 * kPi, 2 * kPi, -1.5 * kPi}) {
    ASSERT_TRUE(free.towards(angle)) << angle;
    EXPECT_NEAR(*free.towards(angle), 1.99, 0.0101) << angle;
  }
  // Obliquely the side of the hull meets the wall first: at 30 degrees (2 - 0.34 sin 30)/cos 30.
  EXPECT_NEAR(*free.towards(kPi / 6), (2 - 0.34 * 0.5) / std::cos(kPi / 6), 0.03);
}

TEST(FreeDistances, ADoorIsFreeIfTheHullFitsThrough) {
  EXPECT_FALSE(free_distances(scan_in_room(1.5, 0.5), {}, level_hull()).towards(0));
  const auto narrow = free_distances(scan_in_room(1.5, 0.3), {}, level_hull()).towards(0);
  ASSERT_TRUE(narrow);
  EXPECT_NEAR(*narrow, 1.49, 0.0101);
}

TEST(FreeDistances, WhatTheLaserDoesNotSeeOrIsFarAwayIsNoObstacle) {
  EXPECT_FALSE(free_distances(scan_in_room(8), {}, level_hull()).towards(0));
  LaserScan scan = scan_in_room(2);
  scan.ranges_m.assign(scan.size(), LaserScan::kNoReturn);
  scan.ranges_m[0] = LaserScan::kInvalid;
  const FreeDistances free = free_distances(scan, {}, level_hull());
  for (const std::uint8_t units : free.units) EXPECT_EQ(units, FreeDistances::kNothing);
}

TEST(FreeDistances, TheFloorIsNoObstacleForATiltedVehicle) {
  // Pitched down by 0.3 rad, 0.3 m above the floor: the beams ahead end on the floor 1 m away.
  LaserScan scan = scan_in_room(2);
  const double floor_m = 0.3 / std::sin(0.3);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const double down = std::sin(0.3) * std::cos(scan.angle_rad(i));
    if (down * static_cast<double>(scan.ranges_m[i]) > 0.3) scan.ranges_m[i] = static_cast<float>(0.3 / down);
  }
  HullPose hull = level_hull();
  hull.height_m = 0.3;
  hull.pitch_rad = 0.3;
  EXPECT_FALSE(free_distances(scan, {}, hull).towards(0));
  hull.pitch_rad = 0;  // a vehicle that does not know its tilt takes it for a wall
  EXPECT_NEAR(*free_distances(scan, {}, hull).towards(0), floor_m, 0.05);
}

TEST(FreeDistances, TheLasersPlaceAndMirrorsCount) {
  LaserRig rig;
  rig.T_base_laser = SE3(so3_exp({0, 0, kPi / 2}), Vec3(0.1, 0, 0));
  rig.horizontal = BeamRange{180, 901};  // what lies ahead of the laser, to the left of the vehicle
  const FreeDistances free = free_distances(scan_in_room(2), rig, level_hull());
  EXPECT_NEAR(*free.towards(kPi / 2), 1.99, 0.0101);
  EXPECT_FALSE(free.towards(-kPi / 2));
}

}  // namespace
}  // namespace hm
