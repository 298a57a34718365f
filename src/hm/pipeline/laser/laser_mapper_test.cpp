#include "hm/pipeline/laser/laser_mapper.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "hm/io/testing/temporary_folder_test_support.hpp"
#include "hm/pipeline/common/parameters.hpp"
#include "hm/pipeline/laser/laser_pipeline.hpp"
#include "hm/pipeline/laser/run/laser_rebuild.hpp"

namespace hm {
namespace {

/// A level vehicle on a circle around the middle of a rectangular room.
LaserScan scan_in_room(int number, double half_length_m = 4, double half_width_m = 3) {
  const double angle = 0.05 * number, x = std::cos(angle), y = std::sin(angle);
  LaserScan scan;
  scan.stamp = Time::from_seconds(0.05 * number);
  scan.angle_min_rad = -2.35, scan.angle_increment_rad = 4.7 / 540;
  scan.range_min_m = 0.1, scan.range_max_m = 30;
  for (std::size_t i = 0; i < 541; ++i) {
    const double bearing = angle + scan.angle_rad(i), c = std::cos(bearing), s = std::sin(bearing);
    const double to_x = c == 0 ? 1e9 : ((c > 0 ? half_length_m : -half_length_m) - x) / c;
    const double to_y = s == 0 ? 1e9 : ((s > 0 ? half_width_m : -half_width_m) - y) / s;
    scan.ranges_m.push_back(static_cast<float>(std::min(to_x, to_y)));
  }
  return scan;
}

LaserPlatform one_laser() { return {{LaserRig{}}}; }

TEST(LaserMapper, GivesThePosesOfThePipeline) {
  auto mapper = LaserMapper::create(one_laser());
  ASSERT_TRUE(mapper) << to_string(mapper.error());
  LaserPipeline pipeline({}, one_laser());
  std::vector<LaserPose> poses;
  for (int i = 0; i < 130; ++i) {
    mapper->add_scan(scan_in_room(i));
    pipeline.add_scan(scan_in_room(i));
    for (LaserPose& pose : mapper->take_poses()) poses.push_back(std::move(pose));
  }
  mapper->finish();
  pipeline.finish();
  for (LaserPose& pose : mapper->take_poses()) poses.push_back(std::move(pose));
  const auto steps = pipeline.take_steps();
  ASSERT_EQ(poses.size(), steps.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_EQ(poses[i].stamp, steps[i].stamp);
    ASSERT_TRUE(poses[i].T_odom_base) << poses[i].reason;
    EXPECT_EQ(poses[i].T_odom_base->matrix(), steps[i].T_odom_base->matrix());
    ASSERT_TRUE(poses[i].T_map_base);
  }
  EXPECT_EQ(mapper->map().serialise(), pipeline.map().serialise());
  ASSERT_EQ(mapper->trajectory().size(), poses.size());
  // Once around: back where it began.
  const Vec3 end = mapper->trajectory()[126].T_world_base.translation();
  EXPECT_LT(end.norm(), 0.05);
}

TEST(LaserMapper, TheCorrectedMapIsTheMapWhereNothingIsCorrected) {
  auto mapper = LaserMapper::create(one_laser(), {"laser.close_loops=false"});
  ASSERT_TRUE(mapper) << to_string(mapper.error());
  for (int i = 0; i < 60; ++i) mapper->add_scan(scan_in_room(i));
  mapper->finish();
  ASSERT_FALSE(mapper->corrects());
  EXPECT_EQ(mapper->corrected_map().serialise(), mapper->map().serialise());
  EXPECT_EQ(mapper->corrected_map().at(Vec3::Zero()), Occupancy::kFree);
}

/// Half around a room: no place is seen again, and keyframes are registered all the same.
TEST(LaserMapper, KeyframesAreRegisteredWithoutLoops) {
  auto mapper = LaserMapper::create(one_laser());
  ASSERT_TRUE(mapper) << to_string(mapper.error());
  for (int i = 0; i < 60; ++i) mapper->add_scan(scan_in_room(i));
  mapper->finish();
  EXPECT_TRUE(mapper->corrects());
  for (const StampedPose& pose : mapper->trajectory()) {
    const double angle = pose.stamp.seconds();  // a radian a second
    const Vec3 truth(std::cos(angle) - 1, std::sin(angle), 0);
    EXPECT_LT((pose.T_world_base.translation() - truth).norm(), 0.02) << angle;
  }
  EXPECT_EQ(mapper->corrected_map().at(Vec3::Zero()), Occupancy::kFree);
}

/// Three times around a room, so that places are seen again.
TEST(LaserMapper, LoopsMoveTheMapAsRebuildingItFromTheRecordingDoes) {
  LaserRecording kept;
  kept.lasers.resize(1);
  LaserRunParameters parameters;
  ASSERT_TRUE(apply_settings(list_laser(parameters), {"laser.poses=scans"}));
  auto mapper = LaserMapper::create(one_laser(), {"laser.poses=scans"});
  ASSERT_TRUE(mapper);
  LaserPipeline pipeline(parameters.laser, one_laser());
  const TemporaryFolder folder;
  MappedScanFile scans(folder.path());
  for (int i = 0; i < 400; ++i) {
    const LaserScan scan = scan_in_room(i, 6, 5);
    kept.lasers[0].scans.push_back(scan);
    mapper->add_scan(scan);
    pipeline.add_scan(scan);
  }
  mapper->finish();
  pipeline.finish();
  for (const LaserStep& step : pipeline.take_steps())
    if (const auto mapped = mapped_scan(step)) scans.add(*mapped);
  const auto wanted =
      rebuild_laser_map({kept, one_laser().rigs, scans, pipeline.map_frame()}, parameters.laser, {});
  ASSERT_TRUE(wanted) << to_string(wanted.error());
  EXPECT_EQ(mapper->corrected_map().serialise(), wanted->serialise());
  EXPECT_TRUE(mapper->corrects());
  EXPECT_NE(mapper->corrected_map().serialise(), mapper->map().serialise());
}

TEST(LaserMapper, RefusesSettingsAndPlatformsThatAreNone) {
  EXPECT_FALSE(LaserMapper::create({}));
  const auto unknown = LaserMapper::create(one_laser(), {"laser.close_loop=true"});
  ASSERT_FALSE(unknown);
  EXPECT_NE(to_string(unknown.error()).find("laser.close_loops"), std::string::npos)
      << to_string(unknown.error());
}

TEST(LaserMapper, SaysWhyAScanHasNoPose) {
  auto mapper = LaserMapper::create(one_laser());
  ASSERT_TRUE(mapper);
  LaserScan empty = scan_in_room(0);
  for (float& range : empty.ranges_m) range = LaserScan::kNoReturn;
  mapper->add_scan(empty);
  mapper->finish();
  const auto poses = mapper->take_poses();
  ASSERT_EQ(poses.size(), 1u);
  EXPECT_FALSE(poses[0].T_odom_base);
  EXPECT_FALSE(poses[0].reason.empty());
}

}  // namespace
}  // namespace hm
