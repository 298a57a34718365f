#include "hm/laser/odometry/scan_projection.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "hm/core/rng.hpp"
#include "hm/laser/testing/planar_world.hpp"

namespace hm {
namespace {

constexpr double kPi = std::numbers::pi;

/// Ranges to the four walls x = +-4, y = +-3, which stand upright, for a laser anywhere in space.
class BoxRoom {
 public:
  [[nodiscard]] double range(const SE3& T_world_laser, double angle_rad) const {
    const Vec3 direction = T_world_laser.rotation() * Vec3(std::cos(angle_rad), std::sin(angle_rad), 0);
    const Vec3& from = T_world_laser.translation();
    const double along_x = ((direction.x() > 0 ? 4 : -4) - from.x()) / direction.x();
    const double along_y = ((direction.y() > 0 ? 3 : -3) - from.y()) / direction.y();
    return std::min(along_x, along_y);
  }
};

double distance_from_walls(const Vec2& point) {
  return std::min(
      {std::abs(point.x() - 4), std::abs(point.x() + 4), std::abs(point.y() - 3), std::abs(point.y() + 3)});
}

LaserScan empty_scan(std::size_t beams = 541) {
  LaserScan scan;
  scan.stamp = Time::from_seconds(10);
  scan.angle_min_rad = -0.75 * kPi;
  scan.angle_increment_rad = beams > 1 ? 1.5 * kPi / static_cast<double>(beams - 1) : 0;
  scan.time_increment_s = beams > 1 ? 0.02 / static_cast<double>(beams - 1) : 0;
  scan.range_min_m = 0.125;
  scan.range_max_m = 30;
  scan.ranges_m.assign(beams, 2.0F);
  return scan;
}

LaserRig rig_with_lever() {
  LaserRig rig;
  rig.T_base_laser = SE3(rotation_from_roll_pitch_yaw({0, 0, 0.3}), Vec3(0.1, -0.05, 0.4));
  return rig;
}

std::size_t total(const ProjectionCounts& counts) {
  return counts.mirrored + counts.thinned + counts.invalid + counts.out_of_range + counts.tilted +
         counts.floor + counts.ceiling + counts.without_attitude;
}

TEST(ScanProjection, PointsOfATiltedVehicleLieOnTheUprightWalls) {
  const BoxRoom room;
  Rng rng(1);
  for (int trial = 0; trial < 30; ++trial) {
    const Vec3 angles(rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3), rng.uniform(-kPi, kPi));
    const SE3 T_world_base(rotation_from_roll_pitch_yaw(angles),
                           Vec3(rng.uniform(-2, 2), rng.uniform(-1, 1), 1.5));
    LaserScan scan = empty_scan();
    const LaserRig rig = rig_with_lever();
    for (std::size_t i = 0; i < scan.size(); ++i)
      scan.ranges_m[i] = static_cast<float>(room.range(T_world_base * rig.T_base_laser, scan.angle_rad(i)));
    AttitudeHistory attitude;
    attitude.add(scan.stamp, T_world_base.rotation());
    ScanProjectionParams params;
    params.max_tilt_rad = 0.6;
    const ProjectedScan result = ScanProjector(rig, params).project(scan, {&attitude, {}, {}, {}});
    ASSERT_EQ(result.status, ProjectionStatus::kOk);
    ASSERT_EQ(result.scan.size(), scan.size());
    EXPECT_NEAR(result.tilt_rad, std::acos(std::cos(angles.x()) * std::cos(angles.y())), 1e-9);
    const SE2 T_world_ortho = SE2::from_se3(T_world_base);
    for (const Vec2& point : result.scan.points_m)
      EXPECT_LT(distance_from_walls(T_world_ortho * point), 2e-6);
    const Vec3 laser = (T_world_base * rig.T_base_laser).translation();
    EXPECT_LT((T_world_ortho * result.scan.origin_m - laser.head<2>()).norm(), 1e-12);
    for (std::size_t i = 1; i < result.scan.size(); ++i)
      ASSERT_GT(result.scan.bearings_rad[i], result.scan.bearings_rad[i - 1]);
  }
}

/// Eqs 2.1 to 2.3 written out for one beam.
TEST(ScanProjection, FollowsTheEquationsForOneBeam) {
  LaserScan scan = empty_scan(1);
  scan.angle_min_rad = 0.7;
  const Vec3 angles(0.2, -0.1, 1.1);
  AttitudeHistory attitude;
  attitude.add(scan.stamp, rotation_from_roll_pitch_yaw(angles));
  const LaserRig rig = rig_with_lever();
  const ProjectedScan result = ScanProjector(rig).project(scan, {&attitude, {}, {}, {}});
  const SE3 T_world_base(rotation_from_roll_pitch_yaw(angles), Vec3(5, 6, 7));
  const Vec3 end = T_world_base * (rig.T_base_laser * Vec3(2 * std::cos(0.7), 2 * std::sin(0.7), 0));
  const Vec2 expected = SE2(5, 6, 1.1).inverse() * Vec2(end.head<2>());
  ASSERT_EQ(result.scan.size(), 1U);
  EXPECT_LT((result.scan.points_m[0] - expected).norm(), 1e-12);
}

/// The vehicle rolls, yaws and flies during the sweep: with the attitude at each beam's time and the
/// velocity, the points lie on the walls; with one attitude for all they do not.
TEST(ScanProjection, EachBeamIsTurnedByItsOwnAttitude) {
  const BoxRoom room;
  LaserScan scan = empty_scan(1081);
  const Vec2 velocity(1.4, -0.6);
  const Time middle = scan.stamp + Duration::from_seconds(0.01);
  const auto pose_at = [&](Time t) {
    const double dt = (t - middle).seconds();
    return SE3(rotation_from_roll_pitch_yaw({0.1 + 1.0 * dt, -0.05 + 0.5 * dt, 0.4 + 1.5 * dt}),
               Vec3(0.5 + velocity.x() * dt, velocity.y() * dt, 1.2));
  };
  for (std::size_t i = 0; i < scan.size(); ++i)
    scan.ranges_m[i] = static_cast<float>(room.range(pose_at(scan.stamp_of(i)), scan.angle_rad(i)));
  AttitudeHistory attitude, late;
  for (int k = -20; k <= 40; ++k) {
    const Time t = scan.stamp + Duration::from_seconds(k * 1e-3);
    attitude.add(t, pose_at(t).rotation());
  }
  late.add(scan.stamp + Duration::from_seconds(0.02),
           pose_at(scan.stamp + Duration::from_seconds(0.02)).rotation());
  const SE2 T_world_ortho = SE2::from_se3(pose_at(middle));
  const Vec2 velocity_ortho = T_world_ortho.rotation().transpose() * velocity;
  const Vec3 motion(velocity_ortho.x(), velocity_ortho.y(), 0);
  ScanProjector projector({});
  const auto worst = [&](const SweepMotion& sweep) {
    double distance = 0;
    const ProjectedScan result = projector.project(scan, sweep);
    EXPECT_EQ(result.scan.size(), scan.size());
    EXPECT_EQ(result.scan.stamp, middle);
    for (const Vec2& point : result.scan.points_m)
      distance = std::max(distance, distance_from_walls(T_world_ortho * point));
    return distance;
  };
  EXPECT_LT(worst({&attitude, motion, {}, {}}), 1e-4);
  EXPECT_GT(worst({&attitude, {}, {}, {}}), 0.01);
  EXPECT_GT(worst({&late, motion, {}, {}}), 0.03);
}

TEST(ScanProjection, YawRateOfTheVelocityCountsWithoutAttitude) {
  const BoxRoom room;
  LaserScan scan = empty_scan(1081);
  const Time middle = scan.stamp + Duration::from_seconds(0.01);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const SE2 pose(0, 0, 2.0 * (scan.stamp_of(i) - middle).seconds());
    scan.ranges_m[i] = static_cast<float>(room.range(pose.to_se3(), scan.angle_rad(i)));
  }
  ScanProjector projector({});
  double with = 0, without = 0;
  for (const Vec2& p : projector.project(scan, {nullptr, Vec3(0, 0, 2.0), {}, {}}).scan.points_m)
    with = std::max(with, distance_from_walls(p));
  for (const Vec2& p : projector.project(scan).scan.points_m)
    without = std::max(without, distance_from_walls(p));
  EXPECT_LT(with, 1e-4);
  EXPECT_GT(without, 0.02);
}

TEST(ScanProjection, FloorAndCeilingHitsAreLeftOut) {
  // Pitched nose down by 0.3 rad at 1 m: the beam ahead meets the floor after 1 / sin(0.3) = 3.384 m.
  LaserScan scan = empty_scan(3);
  scan.angle_min_rad = 0;
  scan.angle_increment_rad = kPi / 2;  // ahead, left, behind
  AttitudeHistory attitude;
  attitude.add(scan.stamp, rotation_from_roll_pitch_yaw({0, 0.3, 0}));
  ScanProjectionParams params;
  params.surface_margin_m = 0.1;
  ScanProjector projector({}, params);
  const SweepMotion motion{&attitude, {}, 1.0, 0.8};
  const double to_floor_m = 1 / std::sin(0.3), to_ceiling_m = 0.8 / std::sin(0.3),
               slack_m = 0.1 / std::sin(0.3);
  const auto counts = [&](double ahead_m, double behind_m) {
    scan.ranges_m = {static_cast<float>(ahead_m), 2.0F, static_cast<float>(behind_m)};
    return projector.project(scan, motion).counts;
  };
  EXPECT_EQ(counts(to_floor_m - slack_m - 0.01, 1).floor, 0U);
  EXPECT_EQ(counts(to_floor_m - slack_m + 0.01, 1).floor, 1U);
  EXPECT_EQ(counts(1, to_ceiling_m - slack_m - 0.01).ceiling, 0U);
  EXPECT_EQ(counts(1, to_ceiling_m - slack_m + 0.01).ceiling, 1U);
  EXPECT_EQ(total(counts(to_floor_m, to_ceiling_m)), 2U);
}

/// Max-range and infinite readings were projected as points by the author's package.
TEST(ScanProjection, WhatIsNoReturnIsCountedAndNeverAPoint) {
  LaserScan scan = empty_scan(9);
  scan.ranges_m = {0.125F, 0.05F, 30.0F, 81.83F, LaserScan::kNoReturn, LaserScan::kInvalid,
                   -1.0F,  2.0F,  3.0F};
  const ProjectedScan result = ScanProjector({}).project(scan);
  EXPECT_EQ(result.status, ProjectionStatus::kOk);
  EXPECT_EQ(result.scan.size(), 2U);
  EXPECT_EQ(result.counts.out_of_range, 6U);
  EXPECT_EQ(result.counts.invalid, 1U);
  EXPECT_EQ(total(result.counts) + result.scan.size(), scan.size());
}

TEST(ScanProjection, SaysWhyThereIsNoScan) {
  LaserScan scan = empty_scan();
  EXPECT_EQ(ScanProjector({}).project({}).status, ProjectionStatus::kNoPoints);
  AttitudeHistory attitude;
  EXPECT_EQ(ScanProjector({}).project(scan, {&attitude, {}, {}, {}}).status, ProjectionStatus::kNoAttitude);
  attitude.add(scan.stamp, rotation_from_roll_pitch_yaw({0.5, 0, 0}));
  const ProjectedScan tilted = ScanProjector({}).project(scan, {&attitude, {}, {}, {}});
  EXPECT_EQ(tilted.status, ProjectionStatus::kTiltTooLarge);
  EXPECT_EQ(tilted.scan.size(), 0U);
  EXPECT_EQ(tilted.counts.tilted, scan.size());
  EXPECT_NEAR(tilted.tilt_rad, 0.5, 1e-9);
  scan.ranges_m.assign(scan.size(), LaserScan::kNoReturn);
  EXPECT_EQ(ScanProjector({}).project(scan).status, ProjectionStatus::kNoPoints);
}

TEST(ScanProjection, SplitsAndThins) {
  LaserScan scan = empty_scan(1080);
  LaserRig rig;
  rig.horizontal = BeamRange{56, 1024};
  ScanProjectionParams params;
  params.every_nth_beam = 5;
  const ProjectedScan fifth = ScanProjector(rig, params).project(scan);
  EXPECT_EQ(fifth.scan.size(), 194U);
  EXPECT_EQ(fifth.counts.mirrored, 112U);
  EXPECT_NEAR(static_cast<double>(fifth.scan.bearings_rad[0]), scan.angle_rad(56), 1e-6);
  EXPECT_NEAR(static_cast<double>(fifth.scan.bearings_rad[1]), scan.angle_rad(61), 1e-6);
  params.every_nth_beam = 1;
  params.min_spacing_m = 0.05;
  const ProjectedScan spaced = ScanProjector(rig, params).project(scan);
  for (std::size_t i = 1; i < spaced.scan.size(); ++i)
    EXPECT_GE((spaced.scan.points_m[i] - spaced.scan.points_m[i - 1]).norm(), 0.05);
  EXPECT_EQ(total(spaced.counts) + spaced.scan.size(), scan.size());
  EXPECT_GT(spaced.scan.size(), 100U);
}

TEST(AttitudeHistory, InterpolatesAlongTheArcAndKnowsItsLimits) {
  AttitudeHistory history(1.0, 0.05);
  EXPECT_FALSE(history.at({}).has_value());
  const auto roll = [](double angle) { return rotation_from_roll_pitch_yaw({angle, 0, 0}); };
  EXPECT_TRUE(history.add(Time::from_seconds(1.0), roll(0)));
  EXPECT_TRUE(history.add(Time::from_seconds(1.04), roll(0.4)));
  EXPECT_FALSE(history.add(Time::from_seconds(1.04), roll(1)));
  EXPECT_FALSE(history.add(Time::from_seconds(1.03), roll(1)));
  EXPECT_FALSE(history.add(Time::from_seconds(2.0), Mat3::Constant(NAN)));
  EXPECT_LT((*history.at(Time::from_seconds(1.01)) - roll(0.1)).norm(), 1e-9);
  EXPECT_LT((*history.at(Time::from_seconds(1.07)) - roll(0.4)).norm(), 1e-9);
  EXPECT_LT((*history.at(Time::from_seconds(0.96)) - roll(0.0)).norm(), 1e-9);
  EXPECT_FALSE(history.at(Time::from_seconds(1.10)).has_value());
  EXPECT_FALSE(history.at(Time::from_seconds(0.94)).has_value());
  for (int k = 0; k < 10000; ++k) history.add(Time::from_seconds(2 + 0.01 * k), roll(0));
  EXPECT_LT(history.size(), 300U);
}

TEST(PlanarScan, SortingPutsAnyPointsInOrderOfBearing) {
  Rng rng(3);
  const PlanarScan sorted = laser_testing::planar_scan_of_world(laser_testing::room_world(), {}, {}, rng);
  PlanarScan shuffled = sorted;
  for (std::size_t i = shuffled.size(); i > 1; --i)
    std::swap(shuffled.points_m[i - 1], shuffled.points_m[rng.below(static_cast<std::uint32_t>(i))]);
  shuffled.points_m.emplace_back(NAN, 1);
  shuffled.points_m.push_back(shuffled.origin_m);
  sort_by_bearing(shuffled);
  ASSERT_EQ(shuffled.size(), sorted.size());
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    EXPECT_EQ(shuffled.points_m[i], sorted.points_m[i]);
    EXPECT_NEAR(shuffled.bearings_rad[i], sorted.bearings_rad[i], 1e-5);
    EXPECT_NEAR(shuffled.ranges_m[i], sorted.ranges_m[i], 1e-4);
  }
}

}  // namespace
}  // namespace hm
