#include <gtest/gtest.h>

#include "hm/evaluation/relation_error.hpp"
#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/pose/relations_file.hpp"
#include "hm/io/testing/real_data_test_support.hpp"
#include "hm/laser/odometry/scan_projection.hpp"
#include "hm/sensors/wheel_odometry.hpp"
#include "hm/slam/laser/laser_loop_closer.hpp"

/// The Intel lab, driven by scan matching with degraded wheel odometry as prediction, closes its loops.
namespace hm {
namespace {

std::filesystem::path data(const std::string& name) { return real_data_folder() / name; }

double mean_error_m(const Trajectory& estimate, const RelationList& list, double max_gap_s) {
  const auto errors = evaluate_relations(estimate, list.relations, {max_gap_s, 0});
  EXPECT_TRUE(errors);
  return errors ? errors->translation_m.mean : 1e9;
}

TEST(IntelLoops, RelationsHold) {
  const auto log = data("laser/flirt_intel-lab.log"), file = data("laser/intel.relations");
  if (!std::filesystem::exists(log) || !std::filesystem::exists(file))
    GTEST_SKIP() << "no recording at " << log;
  const auto recording = open_laser_recording(log);
  auto list = read_relations(file);
  ASSERT_TRUE(recording && list);
  correct_relations(list->relations, recording->corrected_stamps);
  const LaserStream& laser = recording->lasers.front();
  const Trajectory wheels = degrade_to_wheel_odometry(recording->truth);
  LaserRig rig;
  rig.T_base_laser = laser.T_base_laser;
  ScanProjector projector(rig);
  ScanOdometry odometry;
  LaserLoopCloser closer;
  Trajectory T_odom_base;
  SE2 last;
  for (std::size_t i = 0; i < laser.scans.size(); ++i) {
    const SE2 now = SE2::from_se3(wheels[i].T_world_base);
    const PlanarScan scan = projector.project(laser.scans[i]).scan;
    const SE2 T_map_odom = closer.T_map_odom();
    const int solutions = closer.solutions();
    const OdometryStep step = odometry.process(
        scan, {.T_last_now = last.inverse() * now, .velocity_base = {}, .yaw_change_rad = {}});
    last = now;
    closer.add(scan, step);
    if (step.T_odom_base) T_odom_base.push_back({scan.stamp, step.T_odom_base->to_se3()});
    // `map` moves against `odom` by solutions only.
    if (solutions == closer.solutions() && closer.graph().size() > 1) {
      ASSERT_LT((T_map_odom.inverse() * closer.T_map_odom()).vector().norm(), 1e-6);
    }
  }
  closer.finish();
  EXPECT_GT(T_odom_base.size(), 2650U);
  EXPECT_GT(closer.graph().statistics().accepted, 50U);
  // Relations between two scans of the log; what lies between scans can only be interpolated.
  const double matching_m = mean_error_m(T_odom_base, *list, 0);
  const double loops_m = mean_error_m(closer.graph().corrected(T_odom_base), *list, 0);
  RecordProperty("matching_m", std::to_string(matching_m));
  RecordProperty("loops_m", std::to_string(loops_m));
  EXPECT_LT(matching_m, 0.10);
  EXPECT_LT(loops_m, 0.031);
}

}  // namespace
}  // namespace hm
