#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "hm/laser/matching/pl_icp.hpp"
#include "hm/laser/testing/planar_world.hpp"

// Scenes that do not constrain the motion, and invalid input.
namespace hm {
namespace {

using laser_testing::PlanarWorld;
using laser_testing::TestLaser;

PlanarScan scan_with_noise(const PlanarWorld& world, const SE2& pose, double sigma_m, std::uint64_t seed) {
  Rng rng(seed);
  TestLaser laser;
  laser.range_sigma_m = sigma_m;
  laser.range_max_m = 10;
  return planar_scan_of_world(world, pose, laser, rng);
}

/// Longer than the laser sees, along `angle_rad`.
PlanarWorld corridor(double angle_rad) {
  PlanarWorld world;
  const SE2 turn(0, 0, angle_rad);
  for (const double side : {-1.2, 1.0})
    world.segments.push_back({turn * Vec2(-60, side), turn * Vec2(60, side)});
  return world;
}

TEST(PlIcpDegenerate, ACorridorKeepsTheGuessAlongItself) {
  for (const double angle : {0.0, 0.5, 2.0}) {
    const Vec2 along(std::cos(angle), std::sin(angle)), across(-along.y(), along.x());
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      const auto a = scan_with_noise(corridor(angle), {}, 0.03, 2 * seed);
      const SE2 motion(0.05 * along + 0.04 * across, 0.03);
      const auto b = scan_with_noise(corridor(angle), motion, 0.03, 2 * seed + 1);
      const SE2 guess(0.2 * along, 0);
      const ScanMatch match = PlIcp().match(a, b, guess);
      ASSERT_TRUE(match.ok()) << to_string(match.status);
      ASSERT_EQ(match.free.count, 1);
      EXPECT_NEAR(std::abs(match.free.directions[0].head<2>().dot(along)), 1, 1e-2);
      const Vec2 found = match.T_reference_sensed->translation();
      // As good as the guess along the corridor, as good as the scans across it.
      EXPECT_NEAR(found.dot(along), 0.2, 2e-3);
      EXPECT_NEAR(found.dot(across), 0.04, 0.01);
      EXPECT_NEAR(match.T_reference_sensed->angle(), 0.03, 0.01);
      const Mat2 covariance = match.covariance.topLeftCorner<2, 2>();
      EXPECT_GT(along.dot(covariance * along), 0.5 * kFreeDirectionVariance_m2);
    }
  }
}

TEST(PlIcpDegenerate, ACorridorWithAnEndIsNotFree) {
  PlanarWorld world = corridor(0);
  world.segments.push_back({{7, -1.2}, {7, 1.0}});
  const SE2 motion(0.05, 0.02, 0.01);
  const ScanMatch match =
      PlIcp().match(scan_with_noise(world, {}, 0.01, 1), scan_with_noise(world, motion, 0.01, 2), {});
  ASSERT_TRUE(match.ok());
  EXPECT_EQ(match.free.count, 0) << match.free.to_string();
  EXPECT_NEAR(match.T_reference_sensed->x(), 0.05, 0.01);
}

/// In a corridor two pairs of legs hold the place along it, and they walk. A guess that is known well is not
/// moved by them; one that may be as wrong is.
TEST(PlIcpDegenerate, FewPairsMoveAGuessOnlyWithinItsDeviations) {
  const auto corridor_with_legs = [](double shift_m) {
    PlanarWorld world = corridor(0);
    for (const Vec2& leg : {Vec2(1.6, -0.5), Vec2(2.4, 0.4)})
      world.segments.push_back({leg + Vec2(shift_m, -0.2), leg + Vec2(shift_m, 0.2)});
    return world;
  };
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const auto before = scan_with_noise(corridor_with_legs(0), {}, 0.01, 2 * seed);
    const auto after = scan_with_noise(corridor_with_legs(0.15), {}, 0.01, 2 * seed + 1);
    const auto match = [&](const std::optional<Mat3>& covariance) {
      PlIcp matcher;
      matcher.set_reference(before);
      return matcher.match(after, {}, covariance);
    };
    const ScanMatch without = match({}), known = match(Mat3(Vec3(4e-4, 4e-4, 1e-4).asDiagonal())),
                    vague = match(Mat3(Vec3(0.04, 0.04, 1e-4).asDiagonal()));
    ASSERT_TRUE(without.ok() && known.ok() && vague.ok());
    EXPECT_NEAR(without.T_reference_sensed->x(), -0.15, 0.03);
    EXPECT_EQ(vague.T_reference_sensed->vector(), without.T_reference_sensed->vector());
    EXPECT_NEAR(known.T_reference_sensed->x(), 0, 0.01);
    EXPECT_NEAR(known.T_reference_sensed->y(), 0, 0.01);
    EXPECT_NEAR(known.T_reference_sensed->angle(), 0, 0.01);
    EXPECT_EQ(known.free.count, 1);
    EXPECT_GT(known.covariance(0, 0), 0.5 * kFreeDirectionVariance_m2);
    // Where these pairs are not wanted, the direction that they hold is free.
    ASSERT_GE(without.weak.count, 1);
    EXPECT_GT(std::abs(without.weak.directions[0].x()), 0.9);
    PlIcp matcher;
    matcher.set_reference(before);
    const ScanMatch firm = matcher.match(after, {}, {}, PlIcp::kFirmShare);
    EXPECT_EQ(firm.free.count, 1);
    EXPECT_NEAR(firm.T_reference_sensed->x(), 0, 1e-3);
  }
}

TEST(PlIcpDegenerate, ARoundRoomLeavesTheAngleFree) {
  PlanarWorld world;
  world.circles.push_back({{0, 0}, 3});
  const SE2 motion(0.05, -0.03, 0.1);
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const ScanMatch match = PlIcp().match(scan_with_noise(world, {}, 0.01, 2 * seed),
                                          scan_with_noise(world, motion, 0.01, 2 * seed + 1), {0, 0, 0.02});
    ASSERT_TRUE(match.ok());
    ASSERT_EQ(match.free.count, 1) << match.free.to_string();
    EXPECT_GT(std::abs(match.free.directions[0].z()), 0.99);
    EXPECT_THAT(match.free.to_string(), testing::StartsWith("around (")) << match.free.to_string();
    // Around the room's centre the guess stays; the centre itself is found.
    EXPECT_NEAR(match.T_reference_sensed->angle(), 0.02, 2e-3);
    EXPECT_NEAR(match.T_reference_sensed->x(), 0.05, 0.01);
    EXPECT_NEAR(match.T_reference_sensed->y(), -0.03, 0.01);
  }
}

TEST(PlIcpDegenerate, OneWallLeavesTwoDirectionsNot) {
  PlanarWorld world;
  world.segments.push_back({{3, -50}, {3, 50}});
  const ScanMatch match = PlIcp().match(scan_with_noise(world, {}, 0.01, 1),
                                        scan_with_noise(world, {0.05, 0, 0.02}, 0.01, 2), {0, 0.1, 0});
  ASSERT_TRUE(match.ok());
  ASSERT_EQ(match.free.count, 1);
  EXPECT_EQ(match.free.to_string(), "along 90 deg");
  EXPECT_NEAR(match.T_reference_sensed->y(), 0.1, 3e-3);
  EXPECT_NEAR(match.T_reference_sensed->x(), 0.05, 5e-3);
}

TEST(PlIcpDegenerate, NoAnswerIsAStatusAndNoPose) {
  const PlanarWorld room = laser_testing::room_world();
  const PlanarScan good = scan_with_noise(room, {}, 0.01, 1), empty = scan_with_noise({}, {}, 0.01, 2);
  EXPECT_EQ(empty.size(), 0U);
  PlanarScan three;
  three.points_m = {{1, 0}, {0, 1}, {-1, 0}};
  sort_by_bearing(three);
  PlIcp matcher;
  const auto status = [&](const PlanarScan& a, const PlanarScan& b, const SE2& guess) {
    const ScanMatch match = matcher.match(a, b, guess);
    EXPECT_EQ(match.T_reference_sensed.has_value(), match.ok());
    return match.status;
  };
  EXPECT_EQ(status(good, empty, {}), MatchStatus::kTooFewPoints);
  EXPECT_EQ(status(empty, good, {}), MatchStatus::kTooFewPoints);
  EXPECT_EQ(status(empty, empty, {}), MatchStatus::kTooFewPoints);
  EXPECT_EQ(status(three, good, {}), MatchStatus::kTooFewPoints);
  EXPECT_EQ(status(good, three, {}), MatchStatus::kTooFewPoints);
  EXPECT_EQ(status(good, good, {100, 0, 0}), MatchStatus::kTooFewPairs);
  EXPECT_EQ(status(good, good, {NAN, 0, 0}), MatchStatus::kInvalidGuess);
  EXPECT_EQ(status(good, good, {}), MatchStatus::kMatched);
}

TEST(PlIcpDegenerate, AFarCorrectionIsNoAnswer) {
  PlIcpParams params;
  params.max_linear_correction_m = 0.05;
  PlanarWorld world;
  world.add_box({-4, -3}, {4, 3});
  const ScanMatch match =
      PlIcp(params).match(scan_with_noise(world, {}, 0, 1), scan_with_noise(world, {0.12, 0, 0}, 0, 2), {});
  EXPECT_EQ(match.status, MatchStatus::kCorrectionTooLarge);
  EXPECT_FALSE(match.T_reference_sensed.has_value());
}

TEST(PlIcpDegenerate, NotANumberInAScanIsLeftOut) {
  PlanarScan a = scan_with_noise(laser_testing::room_world(), {}, 0.01, 1),
             b = scan_with_noise(laser_testing::room_world(), {}, 0.01, 2);
  const ScanMatch clean = PlIcp().match(a, b, {0.05, 0, 0});
  for (std::size_t i = 5; i < b.size(); i += 50) b.points_m[i] = {NAN, 1}, a.points_m[i] = {1, INFINITY};
  const ScanMatch match = PlIcp().match(a, b, {0.05, 0, 0});
  ASSERT_TRUE(match.ok());
  EXPECT_LT((match.T_reference_sensed->translation() - clean.T_reference_sensed->translation()).norm(), 5e-3);
}

}  // namespace
}  // namespace hm
