#include "hm/slam/laser/scan_visits.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "hm/laser/testing/planar_world.hpp"

namespace hm {
namespace {

using laser_testing::kOfficeLoop_m;
using laser_testing::office_loop;
using laser_testing::office_world;
using laser_testing::TestLaser;

constexpr double kStep_m = 0.55;

/// Twice around the office; the poses are the true ones.
ScanVisits twice_around(double height_of_second_m = 0) {
  const auto world = office_world();
  Rng rng(3);
  ScanVisits visits;
  for (int i = 0; i * kStep_m < 2 * kOfficeLoop_m; ++i) {
    const SE2 pose = office_loop(i * kStep_m);
    PlanarScan scan = planar_scan_of_world(world, pose, TestLaser{361, 4.7, 12, 0.01}, rng);
    scan.stamp = Time::from_seconds(i);
    visits.add(scan, pose, i * kStep_m > kOfficeLoop_m ? height_of_second_m : 0);
  }
  return visits;
}

double worst(const std::vector<VisitAgreement>& agreements) {
  double most = 0;
  for (const VisitAgreement& agreement : agreements) most = std::max(most, agreement.contradicted_ratio());
  return most;
}

TEST(ScanVisits, ATrueMapIsNotContradicted) {
  const ScanVisits visits = twice_around();
  const auto agreements = visits.compare([](Time, const SE2& pose) { return pose; });
  EXPECT_GT(agreements.size(), visits.size() * 8 / 10);
  EXPECT_LT(worst(agreements), 0.1);
}

TEST(ScanVisits, ASecondVisitMovedByHalfAMetreIsContradictedWhereItLies) {
  const ScanVisits visits = twice_around();
  const auto torn = [](Time stamp, const SE2& pose) {
    return stamp.seconds() * kStep_m > kOfficeLoop_m ? SE2(0.6, 0.6, 0) * pose : pose;
  };
  const auto agreements = visits.compare(torn);
  std::size_t high = 0;
  for (const VisitAgreement& agreement : agreements) high += agreement.contradicted_ratio() > 0.25 ? 1u : 0u;
  EXPECT_GT(high, agreements.size() / 2);
}

TEST(ScanVisits, ATwistOfFiveDegreesIsContradicted) {
  const ScanVisits visits = twice_around();
  const auto twisted = [](Time stamp, const SE2& pose) {
    return stamp.seconds() * kStep_m > kOfficeLoop_m ? SE2(0, 0, 0.087) * pose : pose;
  };
  EXPECT_GT(worst(visits.compare(twisted)), 0.4);
}

TEST(ScanVisits, OneVisitAloneAndOtherFloorsAreNotCompared) {
  const auto at_odometry = [](Time, const SE2& pose) { return pose; };
  EXPECT_TRUE(ScanVisits().compare(at_odometry).empty());
  // The loop's end meets its start also without a second round; further on, only the first floor's does.
  EXPECT_LT(twice_around(3).compare(at_odometry).size(), twice_around().compare(at_odometry).size() / 3);
}

TEST(ScanVisits, ScansAreKeptEveryHalfMetreOrHalfRadian) {
  ScanVisits visits;
  PlanarScan scan;
  for (int i = 0; i < 100; ++i) visits.add(scan, SE2(0.1 * i, 0, 0), 0);
  EXPECT_NEAR(static_cast<double>(visits.size()), 20, 1);
  for (int i = 0; i < 10; ++i) visits.add(scan, SE2(9.9, 0, 0.26 * i), 0);
  EXPECT_NEAR(static_cast<double>(visits.size()), 25, 1);
}

}  // namespace
}  // namespace hm
