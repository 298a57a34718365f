#include "hm/laser/matching/pl_icp.hpp"

#include <gmock/gmock.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <vector>

#include "hm/laser/matching/icp_pairs.hpp"
#include "hm/laser/matching/reference_lines.hpp"
#include "hm/laser/testing/planar_world.hpp"

namespace hm {
namespace {

using laser_testing::PlanarWorld;
using laser_testing::TestLaser;

constexpr double kDegree_rad = std::numbers::pi / 180;

PlanarScan scan_of(const PlanarWorld& world, const SE2& pose, double sigma_m, std::uint64_t seed) {
  Rng rng(seed);
  TestLaser laser;
  laser.range_sigma_m = sigma_m;
  return planar_scan_of_world(world, pose, laser, rng);
}

PlanarWorld box_world() {
  PlanarWorld world;
  world.add_box({-4, -3}, {4, 3});
  return world;
}

double distance_m(const SE2& a, const SE2& b) { return (a.translation() - b.translation()).norm(); }
double turn_rad(const SE2& a, const SE2& b) { return std::abs(wrap_angle(a.angle() - b.angle())); }

/// The same scan in another frame: the vehicle's frame lies at T_frame_scan^-1.
PlanarScan moved(const PlanarScan& scan, const SE2& T_frame_scan) {
  PlanarScan result = scan;
  result.origin_m = T_frame_scan * scan.origin_m;
  for (Vec2& point : result.points_m) point = T_frame_scan * point;
  sort_by_bearing(result);
  return result;
}

TestLaser all_around() {
  TestLaser laser;
  laser.beams = 720;
  laser.field_of_view_rad = 2 * std::numbers::pi * (1 - 1.0 / 720);  // the next beam is the first one again
  return laser;
}

/// A full-circle scan has no seam: for any direction of its first beam, every point finds its partner, with
/// fitted lines and as published, and the motion is correct.
TEST(PlIcp, AFullCircleHasNoSeam) {
  const PlanarWorld room = box_world();
  for (const bool published : {false, true}) {
    PlIcpParams params;
    if (published) params.line_half_length_m = 0;
    for (int trial = 0; trial < 24; ++trial) {
      Rng rng(1);
      const SE2 first(0.3, -0.2, 15 * trial * kDegree_rad), motion(0.02, -0.01, 0.2);
      const PlanarScan a = planar_scan_of_world(room, first, all_around(), rng);
      const PlanarScan b = planar_scan_of_world(room, first * motion, all_around(), rng);
      ReferenceLines lines;
      lines.points.assign(a);
      lines.scans.assign(lines.size(), 1);
      lines.fit({params.line_half_length_m, 0.001});
      EXPECT_TRUE(lines.closed);
      ScanPoints sensed;
      sensed.assign(b);
      IcpPairs pairs;
      pairs.begin(sensed.size(), lines.size());
      EXPECT_EQ(pairs.find(lines, sensed, motion, 1, params), sensed.size()) << trial;
      for (const IcpPairs::Pair& pair : pairs.pairs()) EXPECT_LT(pair.distance2, 0.1F * 0.1F) << trial;
      const ScanMatch match = PlIcp(params).match(a, b, SE2(0, 0, 0.2));
      ASSERT_TRUE(match.ok());
      EXPECT_LT(distance_m(*match.T_reference_sensed, motion), 2e-3);
    }
  }
}

/// Less than a full circle ends where it ends.
TEST(PlIcp, AScanOfLessThanAFullCircleIsOpen) {
  Rng rng(1);
  for (const double field_deg : {180.0, 270.0, 350.0}) {
    TestLaser laser;
    laser.field_of_view_rad = field_deg * kDegree_rad;
    ReferenceLines lines;
    lines.points.assign(planar_scan_of_world(box_world(), SE2(0.3, -0.2, 1), laser, rng));
    lines.scans.assign(lines.size(), 1);
    lines.fit({0.3, 0.001});
    EXPECT_FALSE(lines.closed) << field_deg;
  }
}

TEST(PlIcp, FindsTheMotionBetweenScansWithoutNoise) {
  PlIcp matcher;
  Rng rng(1);
  const PlanarWorld room = box_world();
  for (int trial = 0; trial < 40; ++trial) {
    const SE2 first(rng.uniform(-2, 2), rng.uniform(-1, 1), rng.uniform(-3, 3));
    const SE2 motion(rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), rng.uniform(-0.05, 0.05));
    const auto a = scan_of(room, first, 0, 1), b = scan_of(room, first * motion, 0, 2);
    const ScanMatch match = matcher.match(a, b, {});
    ASSERT_TRUE(match.ok());
    EXPECT_LT(distance_m(*match.T_reference_sensed, motion), 1e-3);
    EXPECT_LT(turn_rad(*match.T_reference_sensed, motion), 5e-4);
    EXPECT_EQ(match.free.count, 0);
  }
}

TEST(PlIcp, BothDirectionsAreInverseOfEachOther) {
  PlIcp matcher;
  const PlanarWorld room = laser_testing::room_world();
  const SE2 first(1, 0.5, 0.3), motion(0.12, -0.05, 0.04);
  for (const double sigma_m : {0.0, 0.01, 0.03}) {
    const auto a = scan_of(room, first, sigma_m, 3), b = scan_of(room, first * motion, sigma_m, 4);
    const ScanMatch forth = matcher.match(a, b, motion), back = matcher.match(b, a, motion.inverse());
    ASSERT_TRUE(forth.ok() && back.ok());
    // Both see the same noise: they differ by a fraction of what it does to either.
    EXPECT_LT(distance_m(*forth.T_reference_sensed, back.T_reference_sensed->inverse()),
              2e-3 + 0.1 * sigma_m);
    EXPECT_LT(turn_rad(*forth.T_reference_sensed, back.T_reference_sensed->inverse()), 5e-4 + 0.03 * sigma_m);
  }
}

TEST(PlIcp, ResultDoesNotDependOnTheFrames) {
  PlIcp matcher;
  const PlanarWorld room = laser_testing::room_world();
  const SE2 first(1, 0.5, 0.3), motion(0.12, -0.05, 0.04);
  const auto a = scan_of(room, first, 0.02, 5), b = scan_of(room, first * motion, 0.02, 6);
  const ScanMatch plain = matcher.match(a, b, {});
  const SE2 T_f_a(12, -7, 1.3), T_g_b(-3, 2, -0.9);
  const SE2 guess = T_f_a * T_g_b.inverse();
  const ScanMatch other = matcher.match(moved(a, T_f_a), moved(b, T_g_b), guess);
  ASSERT_TRUE(plain.ok());
  // The correction is limited by the motion between the frames' origins, which here are far apart.
  ASSERT_TRUE(other.ok()) << to_string(other.status);
  const SE2 back = T_f_a.inverse() * *other.T_reference_sensed * T_g_b;
  EXPECT_LT(distance_m(*plain.T_reference_sensed, back), 1e-4);
  EXPECT_LT(turn_rad(*plain.T_reference_sensed, back), 2e-5);
  // The covariance moves with it: T_f_g = T_f_a * T_a_b * T_b_g.
  Mat3 jacobian = Mat3::Identity();
  jacobian.topLeftCorner<2, 2>() = T_f_a.rotation();
  const Vec2 lever = T_f_a.rotation() * plain.T_reference_sensed->rotation() * T_g_b.inverse().translation();
  jacobian(0, 2) = -lever.y();
  jacobian(1, 2) = lever.x();
  const Mat3 expected = jacobian * plain.covariance * jacobian.transpose();
  EXPECT_LT((other.covariance - expected).norm(), 0.02 * expected.norm());
}

/// At the result, the cost of point-to-line distances is at its minimum over small motions; the reference
/// lines, the pairs and the weights are made here by brute force.
TEST(PlIcp, ResultIsTheNumericMinimumOfTheCost) {
  PlIcpParams params;
  params.keep_percentile_ratio = 1;
  params.adaptive_multiple = 100;
  params.remove_duplicates = false;
  params.range_sigma_m = 0.01;
  const auto a = scan_of(laser_testing::room_world(), {1, 0.5, 0.3}, 0.01, 7);
  const auto b = scan_of(laser_testing::room_world(), SE2(1, 0.5, 0.3) * SE2(0.08, 0.03, -0.02), 0.01, 8);
  PlIcp matcher(params);
  const ScanMatch match = matcher.match(a, b, {});
  ASSERT_TRUE(match.ok());
  ReferenceLines lines;
  lines.points.assign(a);
  lines.scans.assign(lines.size(), 1.0F);
  lines.fit({params.line_half_length_m, params.range_sigma_m});
  const auto cost = [&](const SE2& T, const std::vector<int>& partner) {
    double sum = 0;
    for (std::size_t i = 0; i < b.size(); ++i) {
      if (partner[i] < 0) continue;
      const auto j = static_cast<std::size_t>(partner[i]);
      const Vec2 normal(lines.nx[j], lines.ny[j]),
          turned = SE2(0, 0, match.T_reference_sensed->angle()) * b.points_m[i];
      const double cosine = normal.dot(turned.normalized()),
                   weight = (lines.smooth[j] ? 1 : 0.1) / std::max(cosine * cosine, 0.2);
      const double error = normal.dot(T * b.points_m[i]) - static_cast<double>(lines.d[j]);
      sum += weight * error * error;
    }
    return sum;
  };
  std::vector<int> partner(b.size(), -1);
  for (std::size_t i = 0; i < b.size(); ++i) {
    double nearest = params.kMaxCorrespondenceDistance_m;
    for (std::size_t j = 0; j < a.size(); ++j)
      if (const double d = (*match.T_reference_sensed * b.points_m[i] - a.points_m[j]).norm(); d < nearest)
        nearest = d, partner[i] = static_cast<int>(j);
    if (partner[i] == 0 || partner[i] + 1 == static_cast<int>(a.size())) partner[i] = -1;
  }
  const double at_result = cost(*match.T_reference_sensed, partner);
  for (const Vec3& step : {Vec3(2e-4, 0, 0), Vec3(0, 2e-4, 0), Vec3(0, 0, 1e-4)})
    for (const double sign : {-1.0, 1.0}) {
      const Vec3 there = match.T_reference_sensed->vector() + sign * step;
      EXPECT_GT(cost(SE2(there.x(), there.y(), there.z()), partner), at_result);
    }
}

TEST(PlIcp, CovarianceHoldsInMonteCarlo) {
  const SE2 first(1, 0.5, 0.3), motion(0.1, 0.05, -0.02);
  for (const double sigma_m : {0.01, 0.03}) {
    PlIcp matcher;
    double sum = 0;
    constexpr int kTrials = 200;
    Vec3 mean = Vec3::Zero();
    for (int trial = 0; trial < kTrials; ++trial) {
      const auto a = scan_of(box_world(), first, sigma_m, 1000 + static_cast<std::uint64_t>(2 * trial));
      const auto b =
          scan_of(box_world(), first * motion, sigma_m, 1001 + static_cast<std::uint64_t>(2 * trial));
      const ScanMatch match = matcher.match(a, b, motion);
      ASSERT_TRUE(match.ok());
      EXPECT_NEAR(match.range_sigma_m, sigma_m, 0.2 * sigma_m);
      const Vec3 error = match.T_reference_sensed->vector() - motion.vector();
      sum += error.dot(match.covariance.inverse() * error);
      mean += error / kTrials;
    }
    // Three degrees of freedom.
    EXPECT_GT(sum / kTrials, 2.2) << sigma_m;
    EXPECT_LT(sum / kTrials, 3.8) << sigma_m;
    EXPECT_LT(mean.head<2>().norm(), 0.03 * sigma_m);
    EXPECT_LT(std::abs(mean.z()), 0.01 * sigma_m);
  }
}

TEST(PlIcp, CovarianceHoldsAmongNichesAndPillars) {
  for (const double sigma_m : {0.01, 0.03}) {
    for (const SE2& motion : {SE2(0.1, 0.05, -0.02), SE2(0.4, 0.2, 0.1)}) {
      PlIcp matcher;
      double sum = 0;
      constexpr int kTrials = 240;
      for (int trial = 0; trial < kTrials; ++trial) {
        const SE2 first = laser_testing::office_loop(laser_testing::kOfficeLoop_m * trial / kTrials);
        const auto seed = static_cast<std::uint64_t>(2 * trial);
        const auto a = scan_of(laser_testing::office_world(), first, sigma_m, seed);
        const auto b = scan_of(laser_testing::office_world(), first * motion, sigma_m, seed + 1);
        const ScanMatch match = matcher.match(a, b, motion);
        ASSERT_TRUE(match.ok());
        ASSERT_EQ(match.free.count, 0);
        const Vec3 error = match.T_reference_sensed->vector() - motion.vector();
        sum += error.dot(match.covariance.inverse() * error);
      }
      EXPECT_GT(sum / kTrials, 2.2) << sigma_m;
      EXPECT_LT(sum / kTrials, 4.0) << sigma_m;
    }
  }
}

TEST(PlIcp, FittedLinesBeatThePublishedOnesInNoise) {
  const SE2 first(1, 0.5, 0.3), motion(0.1, 0.05, -0.02);
  PlIcp fitted, published(PlIcpParams::dissertation());
  double fitted2 = 0, published2 = 0;
  for (std::uint64_t trial = 0; trial < 40; ++trial) {
    const auto a = scan_of(laser_testing::room_world(), first, 0.03, 2 * trial);
    const auto b = scan_of(laser_testing::room_world(), first * motion, 0.03, 2 * trial + 1);
    const ScanMatch ours = fitted.match(a, b, motion), theirs = published.match(a, b, motion);
    ASSERT_TRUE(ours.ok() && theirs.ok());
    fitted2 += std::pow(distance_m(*ours.T_reference_sensed, motion), 2);
    published2 += std::pow(distance_m(*theirs.T_reference_sensed, motion), 2);
  }
  EXPECT_LT(std::sqrt(fitted2), 0.8 * std::sqrt(published2));
}

/// A hallway and a room, and between them a wall of 12 cm with a door of 1 m at x = 0.
PlanarWorld door_world() {
  PlanarWorld world;
  world.add_polygon(std::vector<Vec2>{{-6, -1.6},
                                      {6, -1.6},
                                      {6, 0},
                                      {0.5, 0},
                                      {0.5, 0.12},
                                      {4, 0.12},
                                      {4, 5},
                                      {-4, 5},
                                      {-4, 0.12},
                                      {-0.5, 0.12},
                                      {-0.5, 0},
                                      {-6, 0}});
  return world;
}

/// The two faces of a wall are nearer to each other than points are paired: seen from the room, its points
/// must not be paired with the face that the reference saw from the hallway.
TEST(PlIcp, APassedDoorDoesNotPairTheFacesOfItsWall) {
  const PlanarWorld world = door_world();
  const SE2 hallway(Vec2(0, -0.8), std::numbers::pi / 2);
  for (const double y : {0.0, 0.06, 0.2, 0.3, 0.4, 0.6, 0.9}) {
    const SE2 room(Vec2(0.02, y), std::numbers::pi / 2), motion = hallway.inverse() * room;
    const ScanMatch match =
        PlIcp().match(scan_of(world, hallway, 0.01, 3), scan_of(world, room, 0.01, 4), motion);
    ASSERT_TRUE(match.ok()) << y;
    EXPECT_LT(distance_m(*match.T_reference_sensed, motion), 0.01) << y;
  }
}

/// Of two walls that face each other one has moved by 20 cm: both pull, and meet halfway. From a good guess
/// the other walls decide.
TEST(PlIcp, AGoodGuessIsKeptAgainstAWallThatMoved) {
  PlanarWorld before, after;
  before.add_box({-4, -3}, {4, 3});
  after.add_box({-4, -3}, {3.8, 3});
  const SE2 start(Vec2::Zero(), std::numbers::pi / 2), motion(Vec2(0.05, 0.02), 0.01);
  const ScanMatch match =
      PlIcp().match(scan_of(before, start, 0.01, 1), scan_of(after, start * motion, 0.01, 2),
                    motion * SE2(Vec2(0.01, -0.01), 0));
  ASSERT_TRUE(match.ok());
  EXPECT_LT(distance_m(*match.T_reference_sensed, motion), 0.01);
}

TEST(PlIcp, DissertationModeFindsTheMotionToo) {
  PlIcp matcher(PlIcpParams::dissertation());
  const SE2 first(1, 0.5, 0.3), motion(0.05, 0.02, -0.02);
  const auto a = scan_of(laser_testing::room_world(), first, 0.01, 9);
  const auto b = scan_of(laser_testing::room_world(), first * motion, 0.01, 10);
  const ScanMatch match = matcher.match(a, b, {});
  ASSERT_TRUE(match.ok());
  EXPECT_LT(distance_m(*match.T_reference_sensed, motion), 5e-3);
}

TEST(PlIcp, IsDeterministicAndIndependentOfEarlierMatches) {
  const SE2 motion(0.1, 0.05, -0.02);
  const auto a = scan_of(laser_testing::room_world(), {}, 0.02, 11);
  const auto b = scan_of(laser_testing::room_world(), motion, 0.02, 12);
  PlIcp used, fresh;
  const auto other = scan_of(box_world(), {1, 1, 1}, 0.02, 13);
  (void)used.match(other, other, {});
  const ScanMatch first = used.match(a, b, {}), second = fresh.match(a, b, {});
  EXPECT_EQ(first.T_reference_sensed->vector(), second.T_reference_sensed->vector());
  EXPECT_EQ(first.covariance, second.covariance);
  EXPECT_EQ(first.iterations, second.iterations);
}

TEST(PlIcp, EstimatesTheNoiseOfRanges) {
  std::vector<float> scratch;
  for (const double sigma_m : {0.005, 0.01, 0.03}) {
    ScanPoints points;
    points.assign(scan_of(laser_testing::office_world(), laser_testing::office_loop(7), sigma_m, 14));
    EXPECT_NEAR(estimate_range_sigma(points, scratch), sigma_m, 0.15 * sigma_m);
  }
}

TEST(ReferenceLines, FollowTheWallsUpToTheCorners) {
  ReferenceLines lines;
  lines.points.assign(scan_of(box_world(), {0.5, 0.2, 0.4}, 0.02, 15));
  lines.scans.assign(lines.size(), 1.0F);
  lines.fit({0.3, 0.02});
  const SE2 pose(0.5, 0.2, 0.4);
  std::size_t wrong = 0;
  for (std::size_t j = 0; j < lines.size(); ++j) {
    const Vec2 normal = pose.rotation() * Vec2(lines.nx[j], lines.ny[j]);
    // Upright to the walls: one component is 1.
    const double deviation = std::asin(std::min(std::abs(normal.x()), std::abs(normal.y())));
    EXPECT_LT(deviation, 5 * std::sqrt(static_cast<double>(lines.angle_sigma2[j])) + 0.02);
    if (deviation > 10 * kDegree_rad) ++wrong;
  }
  EXPECT_LE(wrong, 8U);  // two points at each corner
}

}  // namespace
}  // namespace hm
