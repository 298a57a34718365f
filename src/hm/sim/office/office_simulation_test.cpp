#include "hm/sim/office/office_simulation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "hm/geometry/se2.hpp"
#include "hm/sim/office/office_floor.hpp"

namespace hm {
namespace {

OfficeSimulation simulate(int seed, bool perfect = false, int scans = 60) {
  OfficeSimulationOptions options;
  options.seed = seed;
  options.perfect = perfect;
  options.scan_limit = scans;
  return OfficeSimulation(options);
}

/// Range of the first wall along a ray, by solving for each of them; panes are not there.
double traced_range(const OfficeFloor& floor, const Vec2& from, double angle_rad) {
  const Vec2 ray(std::cos(angle_rad), std::sin(angle_rad));
  double nearest = std::numeric_limits<double>::infinity();
  for (const OfficeWall& wall : floor.walls) {
    if (wall.glass) continue;
    Mat2 axes;
    axes << ray, wall.a - wall.b;
    if (std::abs(axes.determinant()) < 1e-9) continue;
    const Vec2 solved = axes.inverse() * (wall.a - from);
    if (solved.x() > 0.05 && solved.y() >= 0 && solved.y() <= 1) nearest = std::min(nearest, solved.x());
  }
  return nearest;
}

TEST(OfficeSimulation, PerfectRangesAreThoseOfTheWalls) {
  const OfficeSimulation simulation = simulate(4, true);
  const OfficeFloor floor = make_office_floor(60, 40, 4);
  ASSERT_EQ(simulation.scan_count(), 60U);
  std::size_t compared = 0, none = 0;
  for (std::size_t i = 0; i < simulation.scan_count(); i += 7) {
    const LaserScan scan = simulation.scan(i);
    const auto pose = pose_at(simulation.truth(), scan.stamp, Duration::from_seconds(1));
    ASSERT_TRUE(pose);
    const SE2 truth = SE2::from_se3(*pose);
    for (std::size_t beam = 0; beam < scan.size(); ++beam) {
      const double range = traced_range(floor, truth.translation(), truth.angle() + scan.angle_rad(beam));
      none += !scan.is_return(beam);
      if (range >= 30) {
        EXPECT_FALSE(scan.is_return(beam));
        continue;
      }
      // A beam may pass a corner on one side or the other.
      compared += std::abs(static_cast<double>(scan.ranges_m[beam]) - range) < 1e-4;
    }
  }
  EXPECT_GT(compared + none, 9 * 181 * 99 / 100);
  EXPECT_GT(compared, 1400U);
}

TEST(OfficeSimulation, SameSeedSameBits) {
  const OfficeSimulation a = simulate(1), b = simulate(1), c = simulate(2);
  std::size_t other = 0;
  for (std::size_t i = a.scan_count(); i-- > 0;) {  // in any order
    EXPECT_EQ(a.scan(i).ranges_m, b.scan(i).ranges_m);
    EXPECT_EQ(a.odometry()[i].T_world_base.translation(), b.odometry()[i].T_world_base.translation());
    other += a.scan(i).ranges_m != c.scan(i).ranges_m;
  }
  EXPECT_EQ(other, a.scan_count());
  EXPECT_NE(a.odometry().back().T_world_base.translation(), c.odometry().back().T_world_base.translation());
}

/// Against the same drive without errors: noise is small, glass and people change some beams.
TEST(OfficeSimulation, ErrorsChangeSomeBeams) {
  const OfficeSimulation errs = simulate(2), exact = simulate(2, true);
  std::size_t same = 0, nearer = 0, all = 0;
  double squares = 0;
  for (std::size_t i = 0; i < errs.scan_count(); ++i) {
    const LaserScan a = errs.scan(i), b = exact.scan(i);
    for (std::size_t beam = 0; beam < a.size(); ++beam) {
      if (!b.is_return(beam)) continue;
      ++all;
      const double change = static_cast<double>(a.ranges_m[beam]) - static_cast<double>(b.ranges_m[beam]);
      nearer += change < -0.15;
      if (std::abs(change) >= 0.15) continue;
      ++same;
      squares += change * change;
    }
  }
  EXPECT_GT(same, all * 9 / 10);
  EXPECT_GT(nearer, all / 500);
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(same)), 0.015, 0.006);
}

TEST(OfficeSimulation, WheelsDriftByMetresAndTheTruthCoversTheScans) {
  OfficeSimulationOptions options;
  options.range_max_m = 8;
  const OfficeSimulation simulation(options);
  const Trajectory& wheels = simulation.odometry();
  ASSERT_EQ(wheels.size(), simulation.scan_count());
  EXPECT_EQ(simulation.truth().back().stamp, wheels.back().stamp);
  EXPECT_NEAR(path_length(wheels) / path_length(simulation.truth()), 1.035, 0.02);
  const SE3 T_world_odom = simulation.truth().front().T_world_base;
  const Vec3 end = (T_world_odom * wheels.back().T_world_base).translation();
  EXPECT_GT((end - simulation.truth().back().T_world_base.translation()).norm(), 3);
  for (std::size_t i = 0; i < simulation.scan_count(); i += 20)
    for (const float range : simulation.scan(i).ranges_m)
      EXPECT_TRUE(range < 8.1F || range == LaserScan::kNoReturn);
}

}  // namespace
}  // namespace hm
