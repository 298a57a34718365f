#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/rosbag/bag_writer.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"
#include "hm/pipeline/laser/run/laser_events.hpp"

/// Runs on bags whose transforms say where the laser is.
namespace hm {
namespace {

constexpr double kLever_m = 0.3, kStart_s = 100, kDuration_s = 10;

/// A wheeled vehicle on a circle of 1 m in a room of 8 m x 6 m, with a laser ahead of its base.
struct Drive {
  SE3 T_base_laser;

  [[nodiscard]] static SE3 T_world_base(Time time) {
    const double angle = 0.4 * (time.seconds() - kStart_s);
    return {rotation_from_roll_pitch_yaw({0, 0, angle + std::numbers::pi / 2}),
            Vec3(std::cos(angle), std::sin(angle), 0)};
  }
  [[nodiscard]] static double range_in_room(const Vec3& from, const Vec3& direction) {
    double range = 100;
    for (const auto& [axis, half_m] : {std::pair(0, 4.0), {1, 3.0}})
      if (std::abs(direction(axis)) > 1e-12)
        range = std::min(range, (std::copysign(half_m, direction(axis)) - from(axis)) / direction(axis));
    return range;
  }
  [[nodiscard]] LaserScan scan(Time stamp) const {
    LaserScan scan;
    scan.stamp = stamp;
    // Not symmetric: a scan read the wrong way round is another one.
    scan.angle_min_rad = -2.0, scan.angle_increment_rad = 4.5 / 540;
    scan.time_increment_s = 0.02 / 541;
    scan.range_min_m = 0.1, scan.range_max_m = 30;
    for (std::size_t i = 0; i < 541; ++i) {
      const SE3 T = T_world_base(scan.stamp_of(i)) * T_base_laser;
      const double angle = scan.angle_rad(i);
      scan.ranges_m.push_back(static_cast<float>(
          range_in_room(T.translation(), T.rotation() * Vec3(std::cos(angle), std::sin(angle), 0))));
    }
    return scan;
  }
};

enum class Transforms { kNone, kMount, kMountAndOdometry };

LaserRecording record(const Drive& drive, Transforms transforms) {
  const TemporaryFolder folder;
  BagWriter bag(folder / "a.bag");
  const SE3 T_footprint_link(Mat3::Identity(), Vec3(0, 0, 0.1));
  for (int step = 0; step < static_cast<int>(kDuration_s * 50); ++step) {
    const Time time = Time::from_seconds(kStart_s + 0.02 * step);
    if (step % 5 == 1) bag.write_scan({"/scan", "base_laser_link"}, time, drive.scan(time));
    if (transforms == Transforms::kNone) continue;
    const FrameTransform chain[]{
        {time, "/base_footprint", "/base_link", T_footprint_link},
        {time, "/base_link", "/base_laser_link", T_footprint_link.inverse() * drive.T_base_laser}};
    bag.write_transforms("/tf", time, chain);
    const FrameTransform odometry{time, "/odom", "/base_footprint", Drive::T_world_base(time)};
    if (transforms == Transforms::kMountAndOdometry) bag.write_transforms("/tf", time, {&odometry, 1});
  }
  EXPECT_TRUE(bag.finish());
  auto recording = open_laser_recording(folder / "a.bag");
  EXPECT_TRUE(recording) << to_string(recording.error());
  return recording ? *recording : LaserRecording{};
}

/// The largest horizontal distance of the poses to those of the base, relative to the first one.
double worst_error_m(const LaserRecording& recording) {
  const LaserParameters params;
  LaserPipeline pipeline(params, laser_platform(recording));
  const LaserEvents events(recording, pipeline, params.run);
  for (const LaserEvent& event : events.all()) give(pipeline, recording, event);
  pipeline.finish();
  const auto steps = pipeline.take_steps();
  EXPECT_EQ(steps.size(), recording.lasers.at(0).scans.size());
  double worst_m = 0;
  const SE3 T_world_odom =
      Drive::T_world_base(steps.at(0).stamp) * steps[0].T_odom_base.value_or(SE3()).inverse();
  for (const LaserStep& step : steps) {
    EXPECT_TRUE(step.T_odom_base) << step.reason;
    if (!step.T_odom_base) continue;
    const Vec3 off =
        (T_world_odom * *step.T_odom_base).translation() - Drive::T_world_base(step.stamp).translation();
    worst_m = std::max(worst_m, off.head<2>().norm());
  }
  return worst_m;
}

Drive drive_with(double roll_rad) {
  return {SE3(rotation_from_roll_pitch_yaw({roll_rad, 0, 0}), Vec3(kLever_m, 0, 0.2))};
}

TEST(LaserTransforms, GiveThePathOfTheBase) {
  const Drive drive = drive_with(0);
  EXPECT_LT(worst_error_m(record(drive, Transforms::kMountAndOdometry)), 0.02);
  EXPECT_LT(worst_error_m(record(drive, Transforms::kMount)), 0.02);
}

/// Taken to be at the base, the laser is followed instead: after half a turn it is two levers off.
TEST(LaserTransforms, WithoutThemThePathIsThatOfTheLaser) {
  EXPECT_NEAR(worst_error_m(record(drive_with(0), Transforms::kNone)), 2 * kLever_m, 0.05);
}

TEST(LaserTransforms, ALaserMayHangUpsideDown) {
  const Drive drive = drive_with(std::numbers::pi);
  EXPECT_LT(worst_error_m(record(drive, Transforms::kMountAndOdometry)), 0.02);
  EXPECT_LT(worst_error_m(record(drive, Transforms::kMount)), 0.02);
  // Read as if it stood upright, left is right: the vehicle turns the other way.
  EXPECT_GT(worst_error_m(record(drive, Transforms::kNone)), 1.0);
}

TEST(LaserTransforms, AreTheOdometryOfARun) {
  const LaserRecording recording = record(drive_with(0), Transforms::kMountAndOdometry);
  EXPECT_EQ(recording.odometry.size(), static_cast<std::size_t>(kDuration_s * 50));
  EXPECT_EQ(recording.odometry_source, "/tf (odom -> base_footprint)");
  EXPECT_TRUE(laser_platform(recording).has_odometry);
}

}  // namespace
}  // namespace hm
