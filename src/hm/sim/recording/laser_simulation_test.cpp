#include "hm/sim/recording/laser_simulation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hm/core/parallel.hpp"
#include "hm/sim/sensor/laser_test_support.hpp"

namespace hm {
namespace {

using namespace test;

TEST(LaserSimulation, TruthAboutHeights) {
  LaserSimulationParams params = perfect(WorldKind::kRoom);
  const LaserSimulation simulation(params);
  bool over_chest = false, over_ball = false;
  std::size_t traced = 0;
  for (const HeightTruth& h : simulation.heights()) {
    const Vec3 p = simulation.state_at(h.stamp).T_world_base.translation();
    EXPECT_EQ(h.base_m, p.z());
    const auto down = traced_range({p, -Vec3::UnitZ(), 0}), up = traced_range({p, Vec3::UnitZ(), 0});
    if (!down || !up) continue;
    EXPECT_NEAR(h.floor_m, p.z() - *down, 0.01);
    EXPECT_NEAR(h.ceiling_m, p.z() + *up, 0.01);
    ++traced;
    over_chest |= std::abs(h.floor_m - 0.6) < 1e-6;
    over_ball |= h.floor_m > 0.85 && h.floor_m < 0.91;
  }
  EXPECT_TRUE(over_chest);
  EXPECT_TRUE(over_ball);
  EXPECT_GT(traced, simulation.heights().size() * 99 / 100);
}

TEST(LaserSimulation, SameSeedSameBitsForAnyNumberOfThreads) {
  LaserSimulationParams params;
  params.world = WorldKind::kRoom;
  params.scan_limit = 300;
  params.wheel_odometry = true;
  const LaserSimulation a(params), b(params);
  std::vector<LaserScan> parallel(a.scan_count());
  ParallelLoop(2).for_ranges(a.scan_count() / 50, 1,
                             [&](std::size_t i, std::size_t) { parallel[50 * i] = a.scan(50 * i).measured; });
  params.seed = 2;
  const LaserSimulation c(params);
  for (std::size_t i = 0; i < a.scan_count(); i += 50) {
    EXPECT_TRUE(same(a.scan(i).measured, b.scan(i).measured));
    EXPECT_TRUE(same(a.scan(i).measured, parallel[i]));
    EXPECT_EQ(a.scan(i).at, b.scan(i).at);
    EXPECT_FALSE(same(a.scan(i).measured, c.scan(i).measured));
  }
  const auto imu_a = a.imu(), imu_b = b.imu(), imu_c = c.imu();
  ASSERT_EQ(imu_a.size(), imu_b.size());
  for (std::size_t i = 0; i < imu_a.size(); ++i) {
    EXPECT_EQ(imu_a[i].measured.specific_force_m_s2, imu_b[i].measured.specific_force_m_s2);
    EXPECT_EQ(imu_a[i].at, imu_b[i].at);
    EXPECT_NE(imu_a[i].measured.specific_force_m_s2, imu_c[i].measured.specific_force_m_s2);
  }
  EXPECT_EQ(a.odometry().back().measured.pose.T_world_base.matrix(),
            b.odometry().back().measured.pose.T_world_base.matrix());
}

TEST(LaserSimulation, LatencyIsBetweenStampAndArrival) {
  LaserSimulationParams params;
  params.world = WorldKind::kCorridor;
  params.scan_limit = 40;
  const LaserSimulation late(params);
  params.latency = false;
  const LaserSimulation prompt(params);
  double least = 1, most = 0;
  for (std::size_t i = 0; i < 40; ++i) {
    const auto scan = late.scan(i), now = prompt.scan(i);
    const double delay_s = (scan.at - scan.measured.stamp_of(1080)).seconds();
    least = std::min(least, delay_s), most = std::max(most, delay_s);
    EXPECT_EQ(now.at, now.measured.stamp_of(1080));
    EXPECT_TRUE(same(scan.measured, now.measured));
  }
  EXPECT_GE(least, params.kScanLatency_s - 1e-9);
  EXPECT_LE(most, params.kScanLatency_s + params.kLatencyJitter_s + 1e-9);
  EXPECT_GT(most - least, 0.5 * params.kLatencyJitter_s);
  for (const auto& sample : late.imu())
    EXPECT_GE((sample.at - sample.measured.stamp).seconds(), 0.003 - 1e-9);
}

TEST(LaserSimulation, ImuAndTruthCoverAllBeams) {
  LaserSimulationParams params = perfect(WorldKind::kRoom);
  params.scan_limit = 7;
  params.imu.imu_rate_hz = 130;
  const LaserSimulation simulation(params);
  const LaserScan first = simulation.scan(0).measured, last = simulation.scan(6).measured;
  const auto imu = simulation.imu();
  const Trajectory truth = simulation.truth();
  EXPECT_EQ(truth.front().stamp, first.stamp);
  EXPECT_GE(truth.back().stamp, last.stamp_of(1080));
  EXPECT_GE(imu.back().measured.stamp, last.stamp_of(1080));
  EXPECT_NEAR((imu[10].measured.stamp - imu[0].measured.stamp).seconds(), 10.0 / 130, 1e-8);
  EXPECT_TRUE(simulation.odometry().empty());
}

TEST(LaserSimulation, WheelOdometryDriftsAsStated) {
  LaserSimulationParams params = perfect(WorldKind::kCorridor);
  params.wheel_odometry = true;
  params.odometry_drift_ratio = params.odometry_yaw_rad_m = 0;
  const LaserSimulation exact(params);
  const Trajectory truth = exact.truth();
  const SE3 start = truth.front().T_world_base;
  const auto readings = exact.odometry();
  for (const auto& reading : readings) {
    const StampedPose& pose = reading.measured.pose;
    const SE3 here = exact.state_at(pose.stamp).T_world_base;
    const Vec3 moved = start.inverse() * here.translation();
    EXPECT_LT((moved - pose.T_world_base.translation()).head<2>().norm(), 1e-9);
  }
  params.odometry_drift_ratio = 0.05;
  double squares = 0;
  constexpr int kRuns = 40;
  for (int seed = 1; seed <= kRuns; ++seed) {
    params.seed = seed;
    params.flight.sway_m = 0;
    const auto drifting = LaserSimulation(params).odometry();
    double length = 0, truth_length = 0;
    for (std::size_t i = 1; i < readings.size() && length < 20; ++i) {
      const auto& p = drifting[i].measured.pose.T_world_base.translation();
      length = p.norm();
      truth_length =
          (exact.state_at(drifting[i].measured.pose.stamp).T_world_base.translation() - start.translation())
              .head<2>()
              .norm();
    }
    squares += (length - truth_length) * (length - truth_length);
  }
  EXPECT_NEAR(std::sqrt(squares / kRuns), 0.05 * std::sqrt(20), 0.08);
}

}  // namespace
}  // namespace hm
