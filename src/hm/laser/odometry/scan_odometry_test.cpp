#include "hm/laser/odometry/scan_odometry.hpp"

#include <gmock/gmock.h>

#include <Eigen/LU>
#include <cmath>

#include "hm/laser/testing/planar_world.hpp"

namespace hm {
namespace {

using laser_testing::PlanarWorld;
using laser_testing::TestLaser;

constexpr double kPeriod_s = 0.025;

struct Flight {
  std::vector<SE2> truth;
  std::vector<PlanarScan> scans;
};

/// Scans of the office from a path, 40 a second.
Flight fly(const PlanarWorld& world, const std::vector<SE2>& path, double sigma_m, std::uint64_t seed = 1) {
  Rng rng(seed);
  TestLaser laser;
  laser.range_sigma_m = sigma_m;
  laser.beams = 541;
  Flight flight;
  for (std::size_t i = 0; i < path.size(); ++i) {
    flight.truth.push_back(path[i]);
    flight.scans.push_back(planar_scan_of_world(world, path[i], laser, rng));
    flight.scans.back().stamp = Time::from_seconds(100 + kPeriod_s * static_cast<double>(i));
  }
  return flight;
}

std::vector<SE2> along_the_loop(std::size_t scans, double speed_m_s = 1.4) {
  std::vector<SE2> path;
  for (std::size_t i = 0; i < scans; ++i)
    path.push_back(laser_testing::office_loop(speed_m_s * kPeriod_s * static_cast<double>(i)));
  return path;
}

struct Outcome {
  double rmse_m = 0, end_m = 0;
  int failures = 0, keyframes = 0;
  double iterations = 0;
};

Outcome run(const Flight& flight, const ScanOdometryParams& params) {
  ScanOdometry odometry(params);
  odometry.start(flight.truth[0]);
  Outcome outcome;
  SE2 last = flight.truth[0];
  for (std::size_t i = 0; i < flight.scans.size(); ++i) {
    const OdometryStep step = odometry.process(flight.scans[i]);
    if (step.T_odom_base) last = *step.T_odom_base;
    outcome.failures += !step.T_odom_base;
    outcome.keyframes += step.new_keyframe;
    outcome.iterations += step.match.iterations / static_cast<double>(flight.scans.size());
    outcome.end_m = (last.translation() - flight.truth[i].translation()).norm();
    outcome.rmse_m += outcome.end_m * outcome.end_m;
  }
  outcome.rmse_m = std::sqrt(outcome.rmse_m / static_cast<double>(flight.scans.size()));
  return outcome;
}

TEST(ScanOdometry, FollowsAVehicleThroughTheOffice) {
  const Outcome outcome = run(fly(laser_testing::office_world(), along_the_loop(300), 0.01), {});
  EXPECT_EQ(outcome.failures, 0);
  EXPECT_LT(outcome.rmse_m, 0.015);
  EXPECT_GE(outcome.keyframes, 5);
  EXPECT_LE(outcome.keyframes, 20);
}

TEST(ScanOdometry, StandingStillTheErrorIsBounded) {
  const std::vector<SE2> still(400, SE2(1.5, 1.5, 0.3));
  const Flight flight = fly(laser_testing::office_world(), still, 0.03);
  const Outcome outcome = run(flight, {});
  EXPECT_LT(outcome.rmse_m, 6e-3);  // half of the beams of the benchmark
  EXPECT_EQ(outcome.keyframes, 1);
  ScanOdometryParams frame_to_frame = ScanOdometryParams::dissertation();
  frame_to_frame.use_keyframes = false;
  EXPECT_GT(run(flight, frame_to_frame).rmse_m, 3 * outcome.rmse_m);
}

/// The dissertation's two extensions, on the published matcher.
TEST(ScanOdometry, VelocityAndKeyframesEachHelpAndBothTogetherMost) {
  const Flight flight = fly(laser_testing::office_world(), along_the_loop(300), 0.02);
  const auto outcome = [&](bool keyframes, bool velocity) {
    ScanOdometryParams params = ScanOdometryParams::dissertation();
    params.keyframe_distance_m = 0.5;
    params.keyframe_angle_rad = 0.52;
    params.use_keyframes = keyframes;
    params.use_velocity = velocity;
    return run(flight, params);
  };
  const Outcome neither = outcome(false, false), velocity = outcome(false, true), both = outcome(true, true);
  EXPECT_GT(neither.rmse_m, 0.5);
  EXPECT_LT(velocity.rmse_m, 0.5 * neither.rmse_m);
  EXPECT_LT(both.rmse_m, 0.5 * velocity.rmse_m);
  EXPECT_GT(neither.iterations, velocity.iterations);
}

TEST(ScanOdometry, AveragingScansInTheReferenceHelps) {
  double single = 0, averaged = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Flight flight = fly(laser_testing::office_world(), along_the_loop(400), 0.03, seed);
    ScanOdometryParams params;
    params.keyframe_distance_m = 0.5;
    averaged += std::pow(run(flight, params).rmse_m, 2);
    params.reference_scans = 1;
    single += std::pow(run(flight, params).rmse_m, 2);
  }
  EXPECT_LT(averaged, 0.6 * single);
}

/// A published matcher turned the prediction about the fixed frame's origin: the error grew with the distance
/// from it. Here `odom` may begin anywhere and the result is the same.
TEST(ScanOdometry, PredictionIsComposedInTheBodyFrame) {
  const Flight flight = fly(laser_testing::office_world(), along_the_loop(150), 0.01);
  ScanOdometry near, far;
  const SE2 T_far_near(500, -300, 2.5);
  near.start(flight.truth[0]);
  far.start(T_far_near * flight.truth[0]);
  for (const PlanarScan& scan : flight.scans) {
    const OdometryStep a = near.process(scan), b = far.process(scan);
    ASSERT_TRUE(a.T_odom_base && b.T_odom_base);
    const SE2 predicted = T_far_near.inverse() * b.T_odom_base_predicted;
    EXPECT_LT((predicted.translation() - a.T_odom_base_predicted.translation()).norm(), 1e-6);
    EXPECT_EQ(a.match.iterations, b.match.iterations);
  }
  EXPECT_LT((far.velocity_base() - near.velocity_base()).norm(), 1e-6);
  EXPECT_NEAR(near.velocity_base().x(), 1.4, 0.2);
}

TEST(ScanOdometry, GivenPredictionsTakePrecedence) {
  const Flight flight = fly(laser_testing::office_world(), along_the_loop(3), 0);
  const auto predicted = [&](const MotionPrediction& prediction) {
    ScanOdometry odometry;
    odometry.start(SE2(1, 2, 0.5));
    (void)odometry.process(flight.scans[0]);
    const OdometryStep step = odometry.process(flight.scans[1], prediction);
    return SE2(1, 2, 0.5).inverse() * step.T_odom_base_predicted;
  };
  const Vec3 velocity(1, 0.2, 0.4);
  const SE2 wheels(0.03, -0.01, 0.02);
  const auto expect = [](const SE2& a, const SE2& b) {
    EXPECT_LT((a.translation() - b.translation()).norm(), 1e-12);
    EXPECT_NEAR(a.angle(), b.angle(), 1e-12);
  };
  expect(predicted({}), {});
  expect(predicted({{}, velocity, {}}), SE2::exp(velocity * kPeriod_s));
  expect(predicted({wheels, velocity, {}}), wheels);
  expect(predicted({wheels, velocity, 0.015}), SE2(0.03, -0.01, 0.015));
  expect(predicted({{}, {}, 0.015}), SE2(0, 0, 0.015));
}

TEST(ScanOdometry, InACorridorThePredictionCarriesOn) {
  PlanarWorld world;
  for (const double side : {-1.2, 1.0}) world.segments.push_back({{-100, side}, {100, side}});
  std::vector<SE2> path;
  for (int i = 0; i < 60; ++i) path.emplace_back(0.02 * i, 0.01 * std::sin(0.2 * i), 0.0);
  const Flight flight = fly(world, path, 0.02);
  ScanOdometry with_wheels, alone;
  SE2 last_with, last_alone;
  for (std::size_t i = 0; i < path.size(); ++i) {
    MotionPrediction prediction;
    if (i > 0) prediction.T_last_now = path[i - 1].inverse() * path[i];
    const OdometryStep step = with_wheels.process(flight.scans[i], prediction),
                       other = alone.process(flight.scans[i]);
    ASSERT_TRUE(step.T_odom_base && other.T_odom_base) << i;
    if (i > 0) {
      EXPECT_EQ(step.match.free.count, 1) << i;
    }
    last_with = *step.T_odom_base;
    last_alone = *other.T_odom_base;
  }
  EXPECT_NEAR(last_with.x(), path.back().x(), 0.03);
  EXPECT_NEAR(last_with.y(), path.back().y(), 0.02);
  EXPECT_NEAR(last_alone.x(), 0, 0.03);  // nothing says that it moves, and noise does not
  EXPECT_NEAR(last_alone.y(), path.back().y(), 0.02);
}

TEST(ScanOdometry, StampsThatGoBackwardsAreIgnored) {
  const Flight flight = fly(laser_testing::office_world(), along_the_loop(6), 0.01);
  ScanOdometry odometry, clean;
  for (std::size_t i = 0; i < 6; ++i) {
    const OdometryStep step = odometry.process(flight.scans[i]), expected = clean.process(flight.scans[i]);
    EXPECT_EQ(step.T_odom_base->vector(), expected.T_odom_base->vector());
    for (const std::size_t old : {i, std::size_t{0}}) {
      const OdometryStep late = odometry.process(flight.scans[old]);
      EXPECT_EQ(late.status, OdometryStatus::kTimeBackwards);
      EXPECT_FALSE(late.T_odom_base.has_value());
    }
  }
}

TEST(ScanOdometry, AGapForgetsTheVelocity) {
  Flight flight = fly(laser_testing::office_world(), along_the_loop(20), 0.01);
  flight.scans[19] = flight.scans[18];
  flight.scans[19].stamp = flight.scans[18].stamp + Duration::from_seconds(5);
  ScanOdometry odometry;
  SE2 last;
  for (std::size_t i = 0; i < 20; ++i) {
    const OdometryStep step = odometry.process(flight.scans[i]);
    EXPECT_EQ(step.after_gap, i == 19);
    if (i == 19) {
      EXPECT_EQ(step.T_odom_base_predicted.vector(), last.vector());
      EXPECT_EQ(step.status, OdometryStatus::kTracking);
    }
    last = *step.T_odom_base;
  }
  EXPECT_EQ(odometry.velocity_base(), Vec3::Zero());
}

TEST(ScanOdometry, ScansWithoutAMatchAreReportedAndTheTrackIsTakenUpAgain) {
  Flight flight = fly(laser_testing::office_world(), along_the_loop(40), 0.01);
  for (std::size_t i = 20; i < 23; ++i) flight.scans[i].points_m.clear(), sort_by_bearing(flight.scans[i]);
  ScanOdometry odometry;
  odometry.start(flight.truth[0]);
  for (std::size_t i = 0; i < 40; ++i) {
    const OdometryStep step = odometry.process(flight.scans[i]);
    EXPECT_EQ(step.T_odom_base.has_value(), i < 20 || i >= 23) << i;
    if (i >= 20 && i < 23) {
      EXPECT_EQ(step.status, OdometryStatus::kMatchFailed);
      EXPECT_EQ(step.match.status, MatchStatus::kTooFewPoints);
    } else {
      EXPECT_LT((step.T_odom_base->translation() - flight.truth[i].translation()).norm(), 0.02) << i;
    }
  }
}

TEST(ScanOdometry, LostForLongItRestartsAtThePrediction) {
  Flight flight = fly(laser_testing::office_world(), along_the_loop(10), 0.01);
  // Carried to another room.
  const Flight elsewhere = fly(laser_testing::room_world(), std::vector<SE2>(20, SE2(0, 0, 1)), 0.01);
  ScanOdometryParams params;
  params.use_velocity = false;
  params.matcher.min_pairs_ratio = 0.9;
  ScanOdometry odometry(params);
  SE2 last;
  for (const PlanarScan& scan : flight.scans)
    if (const OdometryStep step = odometry.process(scan); step.T_odom_base) last = *step.T_odom_base;
  int restarts = 0, tracked = 0;
  for (PlanarScan scan : elsewhere.scans) {
    scan.stamp = scan.stamp + Duration::from_seconds(10);
    const OdometryStep step = odometry.process(scan);
    if (step.status == OdometryStatus::kRestarted) {
      ++restarts;
      EXPECT_EQ(step.T_odom_base->vector(), last.vector());
      EXPECT_GT(step.covariance(0, 0), 1e3);
      EXPECT_TRUE(step.new_keyframe);
    }
    tracked += step.status == OdometryStatus::kTracking;
  }
  EXPECT_EQ(restarts, 1);
  EXPECT_EQ(tracked, 15);
}

TEST(ScanOdometry, AFirstScanWithoutPointsIsNoReference) {
  ScanOdometry odometry;
  const OdometryStep step = odometry.process({});
  EXPECT_EQ(step.status, OdometryStatus::kTooFewPoints);
  EXPECT_FALSE(step.T_odom_base.has_value());
  const Flight flight = fly(laser_testing::office_world(), along_the_loop(1), 0.01);
  EXPECT_EQ(odometry.process(flight.scans[0]).status, OdometryStatus::kFirstScan);
}

TEST(ScanOdometry, SameScansSameBits) {
  const Flight flight = fly(laser_testing::office_world(), along_the_loop(60), 0.03);
  ScanOdometry first, second;
  for (const PlanarScan& scan : flight.scans) {
    const OdometryStep a = first.process(scan), b = second.process(scan);
    ASSERT_EQ(a.T_odom_base->vector(), b.T_odom_base->vector());
    ASSERT_EQ(a.covariance, b.covariance);
  }
}

TEST(BodyVelocity, FollowsACircleWithoutLag) {
  BodyVelocity velocity(0.9, 0.5);
  const Vec3 twist(1.2, 0.1, 0.8);
  SE2 pose(3, 4, 1);
  velocity.reset(pose);
  for (int i = 0; i < 100; ++i) velocity.update(pose = pose * SE2::exp(twist * kPeriod_s), kPeriod_s);
  EXPECT_LT((velocity.velocity() - twist).norm(), 1e-6);
}

/// Noise of poses at a high rate is none of the velocity.
TEST(BodyVelocity, IsUpdatedAtIntervals) {
  BodyVelocity velocity(0.9, 0.5);
  velocity.reset({}, {1, 0, 0});
  const double dt_s = 0.3 * BodyVelocity::kInterval_s;
  velocity.update(SE2(dt_s + 0.01, 0, 0), dt_s);
  EXPECT_FALSE(velocity.is_due(0));
  EXPECT_EQ(velocity.velocity(), Vec3(1, 0, 0));
  EXPECT_NEAR(velocity.predicted(dt_s).x(), 2 * dt_s, 1e-12);
  for (const int i : {2, 3, 4}) velocity.update(SE2(i * dt_s + (i == 4 ? 0.01 : 0.03), 0, 0), dt_s);
  EXPECT_NEAR(velocity.velocity().x(), 1 + 0.5 * 0.01 / (4 * dt_s), 1e-9);
  EXPECT_NEAR(velocity.since_s(dt_s), dt_s, 1e-12);
}

}  // namespace
}  // namespace hm
