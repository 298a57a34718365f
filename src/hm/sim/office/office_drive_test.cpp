#include "hm/sim/office/office_drive.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "hm/sim/office/wheel_errors.hpp"

namespace hm {
namespace {

double distance_m(const Vec2& point, const OfficeWall& wall) {
  const Vec2 along = wall.b - wall.a;
  const double share = std::clamp((point - wall.a).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (point - (wall.a + share * along)).norm();
}

/// The distances of a drive's poses from the nearest wall, and whether it leaves the corridors.
struct DriveShape {
  double nearest_m = std::numeric_limits<double>::infinity(), length_m = 0;
  bool in_rooms = false;
  std::size_t scans = 0;
};

DriveShape shape_of(const OfficeFloor& floor, const std::vector<DrivePose>& drive) {
  DriveShape shape;
  for (std::size_t i = 0; i < drive.size(); ++i) {
    const Vec2& place = drive[i].T_world_base.translation();
    for (const OfficeWall& wall : floor.walls)
      shape.nearest_m = std::min(shape.nearest_m, distance_m(place, wall));
    const auto far_from = [](const std::vector<double>& lines, double value) {
      return std::ranges::none_of(
          lines, [&](double line) { return std::abs(line - value) < OfficeFloor::kCorridor_m / 2; });
    };
    shape.in_rooms |= far_from(floor.columns_m, place.x()) && far_from(floor.rows_m, place.y());
    shape.scans += drive[i].scans;
    if (i > 0) shape.length_m += (place - drive[i - 1].T_world_base.translation()).norm();
  }
  return shape;
}

TEST(OfficeDrive, PassesThroughCorridorsAndOpenDoorsOnly) {
  std::size_t visiting = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const OfficeFloor floor = make_office_floor(60, 40, seed);
    const DriveShape shape = shape_of(floor, make_office_drive(floor, seed));
    EXPECT_GT(shape.nearest_m, 0.25) << "seed " << seed;
    EXPECT_GT(shape.length_m, 330);
    EXPECT_LT(shape.length_m, 480);
    EXPECT_GT(static_cast<double>(shape.scans), shape.length_m);
    visiting += shape.in_rooms;
  }
  EXPECT_GE(visiting, 8U);
}

TEST(OfficeDrive, StepsAreSmallAndScansApart) {
  const OfficeFloor floor = make_office_floor(60, 40, 3);
  const std::vector<DrivePose> drive = make_office_drive(floor, 3);
  EXPECT_TRUE(drive.front().scans);
  SE2 last = drive.front().T_world_base;
  for (std::size_t i = 1; i < drive.size(); ++i) {
    const SE2 step = drive[i - 1].T_world_base.inverse() * drive[i].T_world_base;
    EXPECT_LE(step.translation().norm(), 0.1 + 1e-9);
    EXPECT_LE(std::abs(step.angle()), 0.05 + 1e-9);
    EXPECT_GT(drive[i].time_s, drive[i - 1].time_s);
    const SE2 since = last.inverse() * drive[i].T_world_base;
    EXPECT_LT(since.translation().norm(), 1.1);
    EXPECT_LT(std::abs(since.angle()), 0.55);
    if (!drive[i].scans) continue;
    EXPECT_TRUE(since.translation().norm() > 0.999 || std::abs(since.angle()) > 0.499);
    last = drive[i].T_world_base;
  }
}

TEST(OfficeDrive, ScansAsOftenAsItIsTold) {
  const OfficeFloor floor = make_office_floor(60, 40, 3);
  const std::vector<DrivePose> rare = make_office_drive(floor, 3), often = make_office_drive(floor, 3, 0.05);
  EXPECT_NEAR(shape_of(floor, often).length_m, shape_of(floor, rare).length_m, 1e-6);
  EXPECT_GT(shape_of(floor, often).scans, 15 * shape_of(floor, rare).scans);
  SE2 last = often.front().T_world_base;
  for (const DrivePose& pose : often) {
    const SE2 since = last.inverse() * pose.T_world_base;
    EXPECT_LT(since.translation().norm(), 0.063);
    EXPECT_LT(std::abs(since.angle()), 0.032);
    if (pose.scans) last = pose.T_world_base;
  }
}

TEST(OfficeFloor, CorridorsArePartOfEveryFloorOthersAreTheSeeds) {
  const OfficeFloor a = make_office_floor(60, 40, 1), b = make_office_floor(60, 40, 2);
  EXPECT_EQ(a.columns_m, b.columns_m);
  EXPECT_EQ(a.rows_m, b.rows_m);
  EXPECT_EQ(a.columns_m.size(), 3U);
  EXPECT_EQ(a.rows_m.size(), 3U);
  EXPECT_EQ(a.rooms.size(), b.rooms.size());
  EXPECT_NE(a.walls.size(), b.walls.size());
  const auto open = std::ranges::count_if(a.rooms, &OfficeRoom::open);
  EXPECT_GT(open, static_cast<std::ptrdiff_t>(a.rooms.size() / 5));
  EXPECT_LT(open, static_cast<std::ptrdiff_t>(a.rooms.size() * 3 / 5));
  EXPECT_GT(std::ranges::count_if(a.walls, &OfficeWall::glass), 20);
}

/// Mean and standard deviation.
struct Statistic {
  double sum = 0, squares = 0;
  int count = 0;
  void add(double value) { sum += value, squares += value * value, ++count; }
  [[nodiscard]] double mean() const { return sum / count; }
  [[nodiscard]] double sigma() const { return std::sqrt(squares / count - mean() * mean()); }
};

/// The fit's own numbers: of motions of a metre, in ten steps, and of turns by 0.5 rad.
TEST(WheelErrors, HaveTheStatisticsOfTheFit) {
  Statistic length, heading, turn, sides;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    WheelErrors wheels{Rng(seed)};
    Statistic own;
    for (int i = 0; i < 200; ++i) {
      SE2 metre, turned;
      for (int k = 0; k < 10; ++k) metre = metre * wheels.measure(SE2(0.1, 0, 0));
      for (int k = 0; k < 10; ++k) turned = turned * wheels.measure(SE2(0, 0, 0.05));
      length.add(metre.translation().norm());
      own.add(metre.angle());
      turn.add(turned.angle() - 0.5);
      EXPECT_EQ(turned.translation().norm(), 0);
    }
    heading.add(own.sigma());
    sides.add(own.mean() > 0);
    EXPECT_NEAR(std::abs(own.mean()), 0.065, 0.02);
  }
  EXPECT_NEAR(length.mean(), 1.035, 0.003);
  EXPECT_NEAR(length.sigma(), 0.039, 0.003);
  EXPECT_NEAR(heading.mean(), 0.060, 0.003);
  EXPECT_NEAR(turn.mean(), 0, 0.003);
  EXPECT_NEAR(turn.sigma(), 0.036, 0.002);
  EXPECT_NEAR(sides.mean(), 0.5, 0.25);
}

}  // namespace
}  // namespace hm
