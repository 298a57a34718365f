#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hm/pipeline/laser/laser_pipeline.hpp"
#include "hm/pipeline/laser/run/laser_evaluation.hpp"
#include "hm/sim/office/office_simulation.hpp"

namespace hm {
namespace {

constexpr int kSeed = 4;

/// Corridors, look-alike rooms and people: what wheels measured holds every match. Without that, searches
/// next to doors put this vehicle up to 1.7 m beside its place, as confirmed, and the map was torn.
TEST(LaserOffice, NoMatchLeavesWhatWheelsMeasured) {
  OfficeSimulationOptions options;
  options.seed = kSeed;
  const OfficeSimulation office(options);
  LaserPipeline pipeline({}, {{LaserRig{}}, false, true});
  for (std::size_t i = 0; i < office.scan_count(); ++i) {
    pipeline.add_odometry(office.odometry()[i]);
    pipeline.add_scan(office.scan(i));
  }
  pipeline.finish();
  const auto steps = pipeline.take_steps();
  ASSERT_EQ(steps.size(), office.scan_count());
  const auto true_pose = [&](const LaserStep& step) {
    return SE2::from_se3(*pose_at(office.truth(), step.stamp, Duration::from_seconds(1)));
  };
  std::size_t unconfirmed = 0;
  double farthest_m = 0, most_rad = 0;
  for (std::size_t i = 1; i < steps.size(); ++i) {
    ASSERT_TRUE(steps[i].odometry.T_odom_base) << i;
    unconfirmed += !steps[i].odometry.confirmed;
    const SE2 motion = steps[i - 1].odometry.T_odom_base->inverse() * *steps[i].odometry.T_odom_base;
    const SE2 error = (true_pose(steps[i - 1]).inverse() * true_pose(steps[i])).inverse() * motion;
    farthest_m = std::max(farthest_m, error.translation().norm());
    most_rad = std::max(most_rad, std::abs(error.angle()));
  }
  EXPECT_LT(farthest_m, 0.2);
  EXPECT_LT(most_rad, 0.05);
  EXPECT_LE(unconfirmed, 4U);
  const LaserMapFrame& frame = pipeline.map_frame();
  const ScanGraph2D& graph = frame.loops()->graph();
  EXPECT_GT(graph.statistics().accepted, 10U);
  EXPECT_EQ(count_wrong_loops(graph, office.truth()), 0U);
  EXPECT_FALSE(count_wrong_loops(graph, {}));
  Trajectory torn = office.truth();
  for (std::size_t i = torn.size() / 2; i < torn.size(); ++i)
    torn[i].T_world_base =
        SE3(torn[i].T_world_base.rotation(), torn[i].T_world_base.translation() + Vec3(2, 1, 0));
  EXPECT_GT(count_wrong_loops(graph, torn), 5U);
  const SE2 T_world_map = true_pose(steps.front());
  double farthest_in_map_m = 0;
  for (const LaserStep& step : steps) {
    const SE2& T_odom_base = *step.odometry.T_odom_base;
    const SE2 T_map_base = frame.T_map_odom_at(step.stamp, T_odom_base) * T_odom_base;
    farthest_in_map_m = std::max(
        farthest_in_map_m, ((T_world_map * T_map_base).translation() - true_pose(step).translation()).norm());
  }
  EXPECT_LT(farthest_in_map_m, 0.6);
}

}  // namespace
}  // namespace hm
