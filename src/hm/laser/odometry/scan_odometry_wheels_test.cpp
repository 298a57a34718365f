#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "hm/laser/odometry/scan_odometry.hpp"
#include "hm/laser/testing/planar_world.hpp"

namespace hm {
namespace {

constexpr laser_testing::TestLaser kHalfCircle{181, std::numbers::pi, 30, 0.01};
constexpr double kCorridor_m = 60;

/// Errors of wheels: so much too long always, and a deviation per root of a metre.
constexpr double kTooLong = 0.035, kWaySigma = 0.039;

/// Error of the length of a corridor whose doors stand back, driven with a scan every `step_m`.
double length_error_m(double step_m) {
  const auto world = laser_testing::corridor_world(kCorridor_m, 0.3);
  Rng rng(7);
  ScanOdometry odometry;
  double first_m = 0, last_m = 0;
  const auto steps = static_cast<int>(kCorridor_m / step_m);
  for (int i = 0; i <= steps; ++i) {
    PlanarScan scan = planar_scan_of_world(world, SE2(i * step_m, 0.2, 0), kHalfCircle, rng);
    scan.stamp = Time::from_seconds(1 + i * step_m / 0.3);
    MotionPrediction prediction;
    if (i > 0)
      prediction.T_last_now =
          SE2((1 + kTooLong) * step_m + kWaySigma * std::sqrt(step_m) * rng.normal(), 0, 0);
    const OdometryStep step = odometry.process(scan, prediction);
    if (!step.T_odom_base) return kCorridor_m;
    last_m = step.T_odom_base->translation().x();
    if (i == 0) first_m = last_m;
  }
  return last_m - first_m - steps * step_m;
}

/// Few pairs hold a place along a corridor, and reveals of other doors hold it as firmly as right ones: from
/// one scan to the next by less than wheels err, so that a vehicle that scans often once stood still.
TEST(ScanOdometryWheels, RevealsOfOtherDoorsDoNotHoldAVehicleBackThatScansOften) {
  for (const double step_m : {0.0125, 0.025, 0.05, 0.1})
    EXPECT_LT(std::abs(length_error_m(step_m)), 0.01 * kCorridor_m) << step_m;
}

}  // namespace
}  // namespace hm
