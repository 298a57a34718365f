#include "hm/pipeline/laser/laser_map_frame.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hm/io/testing/temporary_folder_test_support.hpp"
#include "hm/laser/testing/planar_world.hpp"
#include "hm/pipeline/laser/run/laser_rebuild.hpp"
#include "hm/sensors/wheel_odometry.hpp"

namespace hm {
namespace {

using namespace laser_testing;

constexpr double kStep_m = 0.12, kStep_s = 0.1;
/// Scans of this part of the way see nothing: there wheels alone tell where the vehicle is.
constexpr double kBlindFrom_m = 12, kBlindTo_m = 22;

/// A drive through the corridor of the office, once around and on.
struct Drive {
  LaserRecording recording;
  Trajectory truth;
};

Drive drive(double length_m) {
  const PlanarWorld world = office_world();
  Rng rng(7);
  Drive result;
  LaserStream stream;
  std::int64_t ns = 1'000'000'000;
  for (double at_m = 0; at_m < length_m; at_m += kStep_m) {
    LaserScan scan = scan_world(world, office_loop(at_m), {361, 4.71, 30, 0.01}, rng);
    scan.stamp = Time{ns};
    if (at_m > kBlindFrom_m && at_m < kBlindTo_m)
      std::fill(scan.ranges_m.begin(), scan.ranges_m.end(), LaserScan::kNoReturn);
    result.truth.push_back({scan.stamp, office_loop(at_m).to_se3()});
    stream.scans.push_back(std::move(scan));
    ns += static_cast<std::int64_t>(kStep_s * 1e9);
  }
  result.recording.lasers.push_back(std::move(stream));
  WheelNoiseParams noise;
  noise.seed = 4;
  noise.drift_sigma_rad_per_m = 0.02;
  result.recording.odometry = degrade_to_wheel_odometry(result.truth, noise);
  return result;
}

const LaserPlatform kWheeled{{LaserRig{}}, false, true};

std::vector<LaserScanRecord> run(const Drive& of, LaserPipeline& pipeline) {
  for (const StampedPose& pose : of.recording.odometry) {
    pipeline.add_odometry(pose);
    const auto& scans = of.recording.lasers.front().scans;
    pipeline.add_scan(scans[static_cast<std::size_t>(&pose - of.recording.odometry.data())]);
  }
  pipeline.finish();
  std::vector<LaserScanRecord> records;
  for (LaserStep& step : pipeline.take_steps()) {
    records.emplace_back();
    records.back().step = std::move(step);
  }
  return records;
}

Trajectory odom_of(const std::vector<LaserScanRecord>& records) {
  Trajectory result;
  for (const LaserScanRecord& record : records)
    if (record.step.T_odom_base) result.push_back({record.step.stamp, *record.step.T_odom_base});
  return result;
}

/// Largest error of the pose relative to the first one.
double worst_error_m(const Trajectory& estimate, const Trajectory& truth) {
  const SE3 T_world_map = truth.front().T_world_base * estimate.front().T_world_base.inverse();
  double worst = 0;
  for (const StampedPose& pose : estimate) {
    const auto at = pose_at(truth, pose.stamp, Duration::from_seconds(1));
    worst = std::max(worst, (T_world_map * pose.T_world_base.translation() - at->translation()).norm());
  }
  return worst;
}

/// Share of a map's occupied voxels that lie within a cell or two of what is occupied in another one.
double share_near_walls(const MultiVolumeGrid& map, const MultiVolumeGrid& walls, const SE3& T_walls_map) {
  const auto is_near_wall = [&](const Vec3& p_map) {
    const Vec3 p = T_walls_map * p_map;
    for (int x = -3; x <= 3; ++x)
      for (int y = -3; y <= 3; ++y)
        if (walls.at(p + Vec3(0.05 * x, 0.05 * y, 0)) == Occupancy::kOccupied) return true;
    return false;
  };
  double occupied = 0, near = 0;
  for (const OccupancyVoxel& voxel : map.voxels()) {
    if (voxel.state != Occupancy::kOccupied) continue;
    ++occupied;
    if (is_near_wall({voxel.p_world_centre.x(), voxel.p_world_centre.y(), 0})) ++near;
  }
  return near / occupied;
}

class MapFrameOfLoops : public ::testing::Test {
 protected:
  const Drive drive_ = drive(1.35 * kOfficeLoop_m);
};

TEST_F(MapFrameOfLoops, LoopsCorrectTheMapAndLeaveOdomAsItIs) {
  LaserPipeline pipeline({}, kWheeled);
  const auto records = run(drive_, pipeline);
  const Trajectory odom = odom_of(records);
  const LaserMapFrame& frame = pipeline.map_frame();
  ASSERT_EQ(frame.source(), MapFrameSource::kLoops);
  ASSERT_TRUE(frame.corrects());
  EXPECT_GT(worst_error_m(odom, drive_.truth), 0.4);
  EXPECT_LT(worst_error_m(frame.corrected(odom), drive_.truth), 0.35);
  EXPECT_LT(worst_error_m(frame.corrected(odom), drive_.truth), 0.5 * worst_error_m(odom, drive_.truth));
  // To the bit what it is without loops; `odom` never jumps, although `map` does.
  LaserParameters off;
  off.run.close_loops = false;
  LaserPipeline without(off, kWheeled);
  const Trajectory same = odom_of(run(drive_, without));
  ASSERT_EQ(same.size(), odom.size());
  for (std::size_t i = 0; i < odom.size(); ++i)
    ASSERT_EQ(odom[i].T_world_base.matrix(), same[i].T_world_base.matrix()) << i;
  double farthest_m = 0;
  for (std::size_t i = 1; i < odom.size(); ++i)
    if (odom[i].stamp - odom[i - 1].stamp < Duration::from_seconds(1.5 * kStep_s))
      farthest_m = std::max(
          farthest_m, (odom[i].T_world_base.translation() - odom[i - 1].T_world_base.translation()).norm());
  EXPECT_LT(farthest_m, kStep_m + 0.05);
  ASSERT_FALSE(frame.history().empty());
  EXPECT_GT(frame.history().back().T_map_odom.translation().norm(), 0.1);
  EXPECT_FALSE(without.map_frame().corrects());
  EXPECT_EQ(without.map_frame().T_map_odom_at(odom.back().stamp, SE2(1, 2, 3)).vector(), Vec3::Zero());
}

TEST_F(MapFrameOfLoops, AThreadForLoopsChangesNothingThatIsKnownAtTheEnd) {
  LaserPipeline caller({}, kWheeled), own({}, kWheeled, nullptr, LoopThread::kOwn);
  const Trajectory odom = odom_of(run(drive_, caller));
  const Trajectory same = odom_of(run(drive_, own));
  ASSERT_EQ(same.size(), odom.size());
  const Trajectory corrected = caller.map_frame().corrected(odom), again = own.map_frame().corrected(same);
  ASSERT_TRUE(own.map_frame().corrects());
  const auto& history = own.map_frame().history();
  ASSERT_FALSE(history.empty());
  EXPECT_TRUE(std::ranges::is_sorted(history, {}, &MapFrameChange::stamp));
  const SE2 T_map_odom = caller.map_frame().history().back().T_map_odom;  // smaller changes are not noted
  EXPECT_LT((history.back().T_map_odom.vector() - T_map_odom.vector()).norm(), 1e-8);
  for (std::size_t i = 0; i < odom.size(); ++i) {
    ASSERT_EQ(odom[i].T_world_base.matrix(), same[i].T_world_base.matrix()) << i;
    ASSERT_EQ(corrected[i].T_world_base.matrix(), again[i].T_world_base.matrix()) << i;
  }
}

TEST_F(MapFrameOfLoops, TheMapIsThatOfTheCorrectedPath) {
  LaserPipeline pipeline({}, kWheeled);
  const TemporaryFolder folder;
  MappedScanFile scans(folder.path());
  for (const LaserScanRecord& record : run(drive_, pipeline))
    if (const auto mapped = mapped_scan(record.step)) scans.add(*mapped);
  EXPECT_EQ(folder.file_count(), 0u) << "the file has no name";
  // Without a correction it is the same map again, to the byte.
  const LaserMapFrame none;
  const auto again = rebuild_laser_map({drive_.recording, kWheeled.rigs, scans, none}, {}, {});
  ASSERT_TRUE(again) << to_string(again.error());
  EXPECT_EQ(again->serialise(), pipeline.map().serialise());
  // With it, walls that were seen twice are one.
  const auto map = rebuild_laser_map({drive_.recording, kWheeled.rigs, scans, pipeline.map_frame()}, {}, {});
  ASSERT_TRUE(map) << to_string(map.error());
  LaserParameters params;
  params.run.poses = LaserPoseSource::kOdometry;
  LaserPipeline ideal(params, kWheeled);
  Drive exact = drive_;
  exact.recording.odometry = drive_.truth;
  run(exact, ideal);
  const double corrected = share_near_walls(*map, ideal.map(), drive_.truth.front().T_world_base);
  const double before = share_near_walls(pipeline.map(), ideal.map(), drive_.truth.front().T_world_base);
  EXPECT_GT(corrected, 0.75);
  EXPECT_GT(corrected, before + 0.2);
}

TEST(MappedScans, ComeBackFromTheirFileAsTheyWere) {
  const TemporaryFolder folder;
  MappedScanFile scans(folder.path());
  std::vector<MappedScan> given;
  for (std::size_t i = 0; i < 500; ++i) {
    const auto pose = [i](double x) {
      return SE3(so3_exp(Vec3(0.1 * x, 0.2, 1e-3 * double(i))), Vec3(x, 1.0 / 3, -0.0));
    };
    MappedScan scan{
        i % 2, Time{std::int64_t(i) * 25'000'000}, Time{std::int64_t(i) * 25'000'000 + 7}, pose(0.1), {}};
    for (std::size_t beam = 0; beam < 17 + i % 3; ++beam)
      scan.sweep.push_back({64 * beam, pose(double(beam))});
    given.push_back(scan);
    scans.add(scan);
  }
  EXPECT_EQ(scans.count(), given.size());
  for (int times = 0; times < 2; ++times) {
    std::size_t i = 0;
    const auto read = scans.for_each([&](const MappedScan& scan) {
      ASSERT_LT(i, given.size());
      const MappedScan& wanted = given[i++];
      EXPECT_EQ(scan.laser, wanted.laser);
      EXPECT_EQ(scan.scan_stamp, wanted.scan_stamp);
      EXPECT_EQ(scan.stamp, wanted.stamp);
      EXPECT_EQ(scan.T_odom_base.matrix(), wanted.T_odom_base.matrix());
      ASSERT_EQ(scan.sweep.size(), wanted.sweep.size());
      for (std::size_t knot = 0; knot < scan.sweep.size(); ++knot) {
        EXPECT_EQ(scan.sweep[knot].beam, wanted.sweep[knot].beam);
        EXPECT_EQ(scan.sweep[knot].T_odom_base.matrix(), wanted.sweep[knot].T_odom_base.matrix());
      }
    });
    EXPECT_TRUE(read) << to_string(read.error());
    EXPECT_EQ(i, given.size());
  }
  MappedScanFile nowhere(folder / "missing");
  nowhere.add(given.front());
  ASSERT_FALSE(nowhere.written());
  EXPECT_EQ(nowhere.for_each([](const MappedScan&) {}).error().where, folder / "missing");
}

TEST(MapFrameOfASavedMap, TheVehicleIsFoundAndFollowedInIt) {
  Drive first = drive(kBlindFrom_m);
  first.recording.odometry = first.truth;
  LaserParameters params;
  params.run.poses = LaserPoseSource::kOdometry;
  LaserPipeline mapping(params, kWheeled);
  run(first, mapping);
  const auto grid = laser_slice(mapping.map(), params.run);  // in the frame of the truth
  ASSERT_TRUE(grid);
  // Another drive begins elsewhere, and knows nothing of the first but its map.
  Drive second = drive(kBlindFrom_m);
  const std::size_t skipped = 25;
  second.recording.lasers.front().scans.erase(second.recording.lasers.front().scans.begin(),
                                              second.recording.lasers.front().scans.begin() + skipped);
  second.recording.odometry.erase(second.recording.odometry.begin(),
                                  second.recording.odometry.begin() + skipped);
  LaserPipeline pipeline({}, kWheeled, &*grid);
  const auto records = run(second, pipeline);
  std::size_t located = 0;
  for (const LaserScanRecord& record : records) {
    const auto& place = record.step.map_frame.localisation;
    if (!place || !place->T_map_base) continue;
    ++located;
    const SE2 truth = SE2::from_se3(*pose_at(second.truth, record.step.stamp, Duration::from_seconds(1)));
    EXPECT_LT((place->T_map_base->translation() - truth.translation()).norm(), 0.1);
  }
  EXPECT_GT(located, 9 * records.size() / 10);
  // Poses before the first fix are brought into the map too.
  const Trajectory odom = odom_of(records), corrected = pipeline.map_frame().corrected(odom);
  ASSERT_EQ(corrected.size(), odom.size());
  for (const StampedPose& pose : corrected) {
    const auto truth = pose_at(second.truth, pose.stamp, Duration::from_seconds(1));
    EXPECT_LT((pose.T_world_base.translation() - truth->translation()).norm(), 0.12);
  }
}

}  // namespace
}  // namespace hm
