#include "hm/laser/odometry/wheel_calibration.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/core/rng.hpp"
#include "hm/laser/matching/pl_icp.hpp"

namespace hm {
namespace {

constexpr double kLong = 0.04, kVeer_rad_m = 0.05, kAlong_m = 0.03, kHeading_rad = 0.04;
const Mat3 kMatched = Vec3(1e-5, 1e-5, 1e-6).asDiagonal();

/// What wheels measure that are 4 % too long, veer, and err by random amounts per root of a metre.
SE2 measured(const SE2& motion, Rng& rng) {
  const double way_m = motion.translation().norm(), root = std::sqrt(way_m);
  Vec2 moved = (1 + kLong) * motion.translation();
  if (way_m > 0) moved += motion.translation() / way_m * kAlong_m * root * rng.normal();
  return {moved, motion.angle() + kVeer_rad_m * way_m + kHeading_rad * root * rng.normal()};
}

/// A motion of the drive: straight on, and a turn now and then.
SE2 motion_of(int step, double way_m) { return {way_m, 0, step % 4 == 0 ? 0.3 : 0}; }

TEST(WheelCalibration, LearnsWhatWheelsAlwaysErrByAndTheRest) {
  for (const double way_m : {0.3, 1.0}) {
    Rng rng(3);
    WheelCalibration wheels;
    for (int i = 0; i < 300; ++i) {
      const SE2 motion = motion_of(i, way_m);
      wheels.learn(measured(motion, rng), motion, kMatched);
    }
    EXPECT_NEAR(wheels.scale_error(), 1 / (1 + kLong) - 1, 0.012);
    EXPECT_NEAR(wheels.veer_rad_m(), -kVeer_rad_m, 0.015);
    const Mat3 covariance = wheels.covariance({1, 0, 0});
    EXPECT_NEAR(std::sqrt(covariance(0, 0)), kAlong_m, 0.015);
    EXPECT_NEAR(std::sqrt(covariance(2, 2)), kHeading_rad, 0.015);
    // A drive to the side has its deviations along the side.
    EXPECT_NEAR(wheels.covariance({0, 1, 0})(1, 1), covariance(0, 0), 1e-12);
  }
}

/// The normalised error of corrected motions is that of their covariance.
TEST(WheelCalibration, CovariancesAreHonest) {
  Rng rng(5);
  WheelCalibration wheels;
  double sum_along = 0, sum_heading = 0;
  constexpr int kSteps = 400;
  for (int i = 0; i < 2 * kSteps; ++i) {
    const SE2 motion = motion_of(i, 0.8), by_wheels = measured(motion, rng);
    if (i >= kSteps) {
      const SE2 error = motion.inverse() * wheels.corrected(by_wheels);
      const Mat3 covariance = wheels.covariance(by_wheels);
      sum_along += error.x() * error.x() / covariance(0, 0);
      sum_heading += error.angle() * error.angle() / covariance(2, 2);
    }
    wheels.learn(by_wheels, motion, kMatched);
  }
  EXPECT_GT(sum_along / kSteps, 0.5);
  EXPECT_LT(sum_along / kSteps, 1.3);
  EXPECT_GT(sum_heading / kSteps, 0.5);
  EXPECT_LT(sum_heading / kSteps, 1.3);
}

/// Along a corridor a match keeps what the wheels predicted: it teaches nothing about the way, but the
/// heading.
TEST(WheelCalibration, AFreeDirectionTeachesNothing) {
  Rng rng(7);
  WheelCalibration wheels;
  const double before = wheels.covariance({1, 0, 0})(0, 0);
  Mat3 corridor = kMatched;
  corridor(0, 0) = kFreeDirectionVariance_m2;
  for (int i = 0; i < 300; ++i) {
    const SE2 by_wheels = measured({1, 0, 0}, rng);
    wheels.learn(by_wheels, {by_wheels.translation(), 0}, corridor);
  }
  EXPECT_NEAR(wheels.scale_error(), 0, 1e-3);
  EXPECT_NEAR(wheels.covariance({1, 0, 0})(0, 0), before, 0.1 * before);
  EXPECT_NEAR(wheels.veer_rad_m(), -kVeer_rad_m, 0.015);
}

/// A wheel that slips once in a while does not change what was learned by much.
TEST(WheelCalibration, SlipsCountLittle) {
  Rng rng(9);
  WheelCalibration wheels;
  for (int i = 0; i < 300; ++i) {
    const SE2 motion = motion_of(i, 1.0);
    SE2 by_wheels = measured(motion, rng);
    if (i % 50 == 25) by_wheels = SE2(by_wheels.translation() * 2.5, by_wheels.angle() + 1);
    wheels.learn(by_wheels, motion, kMatched);
  }
  EXPECT_NEAR(wheels.scale_error(), 1 / (1 + kLong) - 1, 0.02);
  EXPECT_NEAR(wheels.veer_rad_m(), -kVeer_rad_m, 0.02);
  EXPECT_LT(std::sqrt(wheels.covariance({1, 0, 0})(0, 0)), 2 * kAlong_m);
}

TEST(WheelCalibration, StandingStillTeachesNothing) {
  WheelCalibration wheels;
  const Mat3 before = wheels.covariance({1, 0, 0.5});
  for (int i = 0; i < 1000; ++i) wheels.learn({1e-3, 0, 1e-3}, {}, kMatched);
  EXPECT_EQ(wheels.covariance({1, 0, 0.5}), before);
  EXPECT_EQ(wheels.corrected({1, 0, 0.5}).vector(), Vec3(1, 0, 0.5));
}

}  // namespace
}  // namespace hm
