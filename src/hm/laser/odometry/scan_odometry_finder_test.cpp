#include <gtest/gtest.h>

#include <cmath>

#include "hm/laser/odometry/scan_odometry.hpp"
#include "hm/laser/testing/planar_world.hpp"

namespace hm {
namespace {

using laser_testing::PlanarWorld;

/// Scans from these places, 40 a second.
std::vector<PlanarScan> scans_from(const PlanarWorld& world, const std::vector<SE2>& path) {
  Rng rng(1);
  std::vector<PlanarScan> scans;
  for (const SE2& pose : path) {
    scans.push_back(planar_scan_of_world(world, pose, {541, 4.71238898038469, 30, 0.01}, rng));
    scans.back().stamp = Time::from_seconds(100 + 0.025 * static_cast<double>(scans.size()));
  }
  return scans;
}

TEST(ScanOdometryFinder, WhereNoMatchIsFoundTheFinderIsAsked) {
  const PlanarWorld world = laser_testing::office_world();
  // A turn that no velocity predicts, and after which the laser sees nothing of what it saw before.
  const SE2 start = laser_testing::office_loop(5), turned = start * SE2(0.1, 0, 2.2);
  std::vector<PlanarScan> scans = scans_from(world, {start, start, turned, turned});
  for (PlanarScan& scan : scans) {
    for (std::size_t i = 0; i < scan.size(); ++i)
      if (std::abs(scan.bearings_rad[i]) > 0.8) scan.points_m[i].setConstant(std::nan(""));
    sort_by_bearing(scan);
  }
  ScanOdometryParams params;
  params.use_velocity = false;
  int searches = 0;
  MotionPrediction prediction;
  prediction.find = [&](const PlanarScan&, const PredictedPose& predicted) -> std::optional<FoundPose> {
    ++searches;
    EXPECT_LT(predicted.T_odom_base.translation().norm(), 0.01);
    return FoundPose{SE2(0.1, 0, 2.2), 1e-4 * Mat3::Identity()};
  };
  ScanOdometry odometry(params);
  std::vector<OdometryStep> steps;
  for (const PlanarScan& scan : scans) steps.push_back(odometry.process(scan, prediction));
  EXPECT_EQ(searches, 1);
  EXPECT_EQ(steps[1].status, OdometryStatus::kTracking);
  EXPECT_FALSE(steps[1].searched);
  EXPECT_EQ(steps[2].status, OdometryStatus::kFound);
  EXPECT_TRUE(steps[2].searched && steps[2].new_keyframe);
  EXPECT_EQ(steps[2].T_odom_base->vector(), SE2(0.1, 0, 2.2).vector());
  EXPECT_GT(steps[2].covariance(0, 0), 0.9e-4);
  EXPECT_EQ(steps[3].status, OdometryStatus::kTracking);
  EXPECT_LT((steps[3].T_odom_base->translation() - Vec2(0.1, 0)).norm(), 0.02);
  // Without a finder the poorly paired match is used, with a correspondingly low pair ratio.
  ScanOdometry alone(params);
  for (std::size_t i = 0; i < 2; ++i) alone.process(scans[i]);
  const OdometryStep poor = alone.process(scans[2]);
  EXPECT_EQ(poor.status, OdometryStatus::kTracking);
  EXPECT_LT(static_cast<double>(poor.match.pairs),
            params.kFindMinPairsRatio * static_cast<double>(poor.match.sensed_points));
}

TEST(ScanOdometryFinder, TheFinderCanComeFirst) {
  const PlanarWorld world = laser_testing::office_world();
  const SE2 start = laser_testing::office_loop(5);
  const std::vector<PlanarScan> scans = scans_from(world, {start, start * SE2(0.1, 0, 0.5)});
  for (const bool finds : {true, false}) {
    int searches = 0;
    MotionPrediction prediction;
    prediction.find_first = true;
    prediction.find = [&](const PlanarScan&, const PredictedPose&) -> std::optional<FoundPose> {
      ++searches;
      if (!finds) return std::nullopt;
      return FoundPose{SE2(0.12, 0.01, 0.48), Mat3::Identity()};
    };
    ScanOdometry odometry;
    odometry.process(scans[0], prediction);
    const OdometryStep step = odometry.process(scans[1], prediction);
    EXPECT_EQ(searches, 1);
    EXPECT_EQ(step.status, OdometryStatus::kTracking);  // the match counts, from wherever it began
    const double error_m = (step.T_odom_base->translation() - Vec2(0.1, 0)).norm();
    EXPECT_LT(error_m, finds ? 0.02 : 0.5);
  }
}

/// What nothing confirms is not certain: wheels count where there are any, else the match, with a large
/// covariance.
TEST(ScanOdometryFinder, UnconfirmedMatchesAreUncertain) {
  const PlanarWorld world = laser_testing::office_world();
  const SE2 start = laser_testing::office_loop(5);
  const std::vector<PlanarScan> scans = scans_from(world, {start, start * SE2(0.1, 0, 0.05)});
  for (const bool wheels : {true, false}) {
    MotionPrediction prediction;
    prediction.confirms = [](const PlanarScan&, const SE2&) { return false; };
    prediction.find = [](const PlanarScan&, const PredictedPose&) { return std::optional<FoundPose>(); };
    const SE2 wheel_motion(0.45, -0.3, 0.4);
    if (wheels) prediction.T_last_now = wheel_motion;
    ScanOdometry odometry;
    odometry.process(scans[0], prediction);
    const OdometryStep step = odometry.process(scans[1], prediction);
    EXPECT_TRUE(step.searched);
    ASSERT_TRUE(step.T_odom_base);
    if (wheels)
      EXPECT_EQ(step.T_odom_base->vector(), wheel_motion.vector());
    else
      EXPECT_LT((step.T_odom_base->translation() - Vec2(0.1, 0)).norm(), 0.02);
    EXPECT_GT(step.match.covariance(0, 0), wheels ? 0.05 * 0.05 : 0.2 * 0.2);
    EXPECT_GT(step.match.covariance(2, 2), wheels ? 0.05 * 0.05 : 0.2 * 0.2);
  }
}

/// A match that the last scans do not confirm, but wheels do: two sources agree, and the match is the better
/// one. The same where the search offers a place that others rival.
TEST(ScanOdometryFinder, WheelsConfirmAMatch) {
  const PlanarWorld world = laser_testing::office_world();
  const SE2 start = laser_testing::office_loop(5);
  const std::vector<PlanarScan> scans = scans_from(world, {start, start * SE2(0.1, 0, 0.05)});
  for (const bool rivalled : {false, true}) {
    MotionPrediction prediction;
    prediction.T_last_now = SE2(0.12, 0.01, 0.08);
    prediction.confirms = [](const PlanarScan&, const SE2&) { return false; };
    prediction.find = [&](const PlanarScan&, const PredictedPose& predicted) {
      EXPECT_TRUE(predicted.covariance && (*predicted.covariance)(0, 0) > 1e-4);
      return rivalled ? std::optional(FoundPose{SE2(0.3, 0.2, 0.3), Mat3::Identity(), false}) : std::nullopt;
    };
    ScanOdometry odometry;
    odometry.process(scans[0], prediction);
    const OdometryStep step = odometry.process(scans[1], prediction);
    EXPECT_EQ(step.status, OdometryStatus::kTracking);
    EXPECT_TRUE(step.searched && step.confirmed);
    EXPECT_LT((step.T_odom_base->translation() - Vec2(0.1, 0)).norm(), 0.02);
    EXPECT_LT(step.match.covariance(0, 0), 0.01 * 0.01);
    EXPECT_TRUE(step.wheel_covariance);
  }
}

/// A match that is confirmed, but lies where wheels cannot have gone, is searched for; what is found counts.
TEST(ScanOdometryFinder, AMatchAgainstTheWheelsIsSearchedFor) {
  const PlanarWorld world = laser_testing::room_world();
  const SE2 start(-0.5, 0.2, 0.3);
  const std::vector<PlanarScan> scans = scans_from(world, {start, start * SE2(0.1, 0, 0.05)});
  MotionPrediction prediction;
  prediction.T_last_now = SE2(0.38, 0, 0.05);  // they slip
  prediction.confirms = [](const PlanarScan&, const SE2&) { return true; };
  int searches = 0;
  prediction.find = [&](const PlanarScan&, const PredictedPose&) {
    ++searches;
    return std::optional(FoundPose{SE2(0.11, 0.01, 0.05), 1e-4 * Mat3::Identity()});
  };
  ScanOdometry odometry;
  odometry.process(scans[0], prediction);
  const OdometryStep step = odometry.process(scans[1], prediction);
  EXPECT_EQ(searches, 1);
  EXPECT_EQ(step.status, OdometryStatus::kTracking);
  EXPECT_LT((step.T_odom_base->translation() - Vec2(0.1, 0)).norm(), 0.02);
}

/// Two scans with almost the same stamp, as a busy computer writes them, are not a motion of many metres a
/// second.
TEST(ScanOdometryFinder, StampsThatBunchDoNotMakeAVelocity) {
  const PlanarWorld world = laser_testing::office_world();
  std::vector<SE2> path;
  for (int i = 0; i < 40; ++i) path.push_back(laser_testing::office_loop(5 + 0.02 * i));
  std::vector<PlanarScan> scans = scans_from(world, path);
  scans[30].stamp = scans[29].stamp + Duration::from_seconds(1e-4);
  ScanOdometry odometry;
  double fastest_m_s = 0;
  for (const PlanarScan& scan : scans) {
    const OdometryStep step = odometry.process(scan);
    EXPECT_TRUE(step.T_odom_base);
    fastest_m_s = std::max(fastest_m_s, odometry.velocity_base().head<2>().norm());
  }
  EXPECT_LT(fastest_m_s, 2);  // 0.8 m/s
}

constexpr double kStep_m = 0.08, kStep_s = 0.1;
constexpr int kHeld = 27, kScans = 42;  // the first keyframe after 2 m is the last that sees the end

/// Scan `i` of a vehicle in a corridor along x, with two people who walk as fast as it goes. First it sees
/// the end; then only the walls and them.
PlanarScan scan_in_corridor(int i, Rng& rng) {
  PlanarWorld world;
  const double x_m = i * kStep_m;
  for (const double side : {-1.2, 1.0}) world.segments.push_back({{-60, side}, {60, side}});
  if (i < kHeld) world.segments.push_back({{8, -1.2}, {8, 1.0}});
  if (i >= kHeld - 1)
    for (const Vec2& leg : {Vec2(1.6, -0.5), Vec2(2.4, 0.4)})
      world.segments.push_back({leg + Vec2(x_m, -0.2), leg + Vec2(x_m, 0.2)});
  PlanarScan scan = planar_scan_of_world(world, SE2(x_m, 0, 0), {541, 4.71238898038469, 10, 0.01}, rng);
  scan.stamp = Time::from_seconds(100 + kStep_s * i);
  return scan;
}

/// Length that odometry measures, with a search that finds the scans so far from where the velocity predicts
/// them; without one where that is nothing.
double driven_in_corridor_m(std::optional<double> shift_m) {
  Rng rng(3);
  MotionPrediction prediction;
  ScanOdometry odometry;
  double x_m = 0;
  for (int i = 0; i < kScans; ++i) {
    if (shift_m && i >= kHeld)
      prediction.find_along = [&](const PlanarScan&, const SE2&, const Vec2&, double) {
        return FoundShift{*shift_m, 0.03};
      };
    if (const OdometryStep step = odometry.process(scan_in_corridor(i, rng), prediction); step.T_odom_base)
      x_m = step.T_odom_base->x();
  }
  return x_m;
}

/// Few pairs that hold the vehicle back count less than the velocity, where the last scans show it there, and
/// only there.
TEST(ScanOdometryFinder, FewPairsDoNotStopAVehicleAgainstTheLastScans) {
  constexpr double kDriven_m = (kScans - 1) * kStep_m;
  EXPECT_LT(driven_in_corridor_m({}), kDriven_m - 0.5);
  EXPECT_NEAR(driven_in_corridor_m(0), kDriven_m, 0.1);
  EXPECT_LT(driven_in_corridor_m(-kStep_m), kDriven_m - 0.5);
}

/// Where neither matching nor the search shows how far the vehicle went, the step says so; with wheels, and
/// where the search shows it, nothing is guessed.
TEST(ScanOdometryFinder, UnobservedMotionIsCounted) {
  struct Case {
    std::optional<double> sigma_m;  // of the search
    bool wheels;
    double guessed_m;
  };
  constexpr int kFree = 5;
  for (const auto& [sigma_m, wheels, guessed_m] :
       {Case{{}, false, kFree * kStep_m}, {0.3, false, kFree * kStep_m}, {0.03, false, 0}, {{}, true, 0}}) {
    Rng rng(3);
    MotionPrediction prediction;
    if (sigma_m)
      prediction.find_along = [&](const PlanarScan&, const SE2&, const Vec2&, double) {
        return FoundShift{0, *sigma_m};
      };
    ScanOdometry odometry;
    double sum_m = 0;
    for (int i = 0; i < 10 + kFree; ++i) {
      PlanarWorld world;
      for (const double side : {-1.2, 1.0}) world.segments.push_back({{-60, side}, {60, side}});
      if (i < 10)
        for (const double x : {-3.0, 3.0}) world.segments.push_back({{x, -1.2}, {x, 1.0}});
      PlanarScan scan = planar_scan_of_world(world, SE2(i * kStep_m, 0, 0), {541, 4.7, 10, 0.01}, rng);
      scan.stamp = Time::from_seconds(100 + kStep_s * i);
      if (wheels && i > 0) prediction.T_last_now = SE2(kStep_m, 0, 0);
      const OdometryStep step = odometry.process(scan, prediction);
      sum_m += step.guessed_m;
      EXPECT_EQ(step.length_observed, i < 10 || guessed_m == 0) << i;
    }
    EXPECT_NEAR(sum_m, guessed_m, 0.02) << sigma_m.value_or(-1) << " " << wheels;
  }
}

/// A match that nothing confirms, and to which no vehicle accelerates, is no motion.
TEST(ScanOdometryFinder, AnUnconfirmedJumpIsNotTracked) {
  const PlanarWorld world = laser_testing::office_world();
  const SE2 start = laser_testing::office_loop(5);
  Rng rng(1);
  MotionPrediction prediction;
  bool confirms = true;
  prediction.find = [](const PlanarScan&, const PredictedPose&) -> std::optional<FoundPose> { return {}; };
  prediction.confirms = [&](const PlanarScan&, const SE2&) { return confirms; };
  ScanOdometry odometry;
  OdometryStep step;
  const auto process = [&](int i, double ahead_m) {
    PlanarScan scan = planar_scan_of_world(world, start * SE2(i * 0.05 + ahead_m, 0, 0), {}, rng);
    scan.stamp = Time::from_seconds(100 + kStep_s * i);
    return odometry.process(scan, prediction);
  };
  int i = 0;
  while (i < 10) step = process(i++, 0);
  ASSERT_EQ(step.status, OdometryStatus::kTracking);
  confirms = false;
  step = process(i++, 0.02);
  EXPECT_EQ(step.status, OdometryStatus::kTracking);
  step = process(i++, 0.3);
  EXPECT_EQ(step.status, OdometryStatus::kFound);
  EXPECT_FALSE(step.confirmed);
  EXPECT_NEAR(step.T_odom_base->x(), 11 * 0.05, 0.05);
  EXPECT_GT(step.match.covariance(0, 0), 0.03);
}

}  // namespace
}  // namespace hm
