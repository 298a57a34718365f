#include "hm/pipeline/laser/laser_pipeline.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hm/core/rng.hpp"
#include "hm/pipeline/laser/laser_sweep.hpp"
#include "hm/pipeline/laser/run/laser_events.hpp"
#include "hm/pipeline/laser/run/laser_scan_counts.hpp"

namespace hm {
namespace {

constexpr double kHalfLength_m = 4.0, kHalfWidth_m = 3.0;  // a room around the origin, endlessly high

/// Distance from a point of the room to its walls along a direction; closed form.
double range_in_room(const Vec3& from, const Vec3& direction) {
  double range = std::numeric_limits<double>::infinity();
  const double halves[2] = {kHalfLength_m, kHalfWidth_m};
  for (int axis = 0; axis < 2; ++axis)
    if (std::abs(direction(axis)) > 1e-12)
      range = std::min(range,
                       ((direction(axis) > 0 ? halves[axis] : -halves[axis]) - from(axis)) / direction(axis));
  return range;
}

/// A vehicle on a circle of 1 m, which rolls and pitches while it flies.
struct Flight {
  double tilt_rad = 0, turn_rad_s = 0.4;
  double bob_m = 0;      // up and down
  double swing_rad = 0;  // of the heading, to and fro
  static constexpr double kBob_rad_s = 0.8;
  [[nodiscard]] SE3 T_world_base(Time time) const {
    const double angle = turn_rad_s * time.seconds();
    const Vec3 rpy(tilt_rad * std::sin(1.3 * time.seconds()), tilt_rad * std::cos(0.9 * time.seconds()),
                   angle + std::numbers::pi / 2 + swing_rad * std::sin(2 * time.seconds()));
    return {rotation_from_roll_pitch_yaw(rpy),
            Vec3(std::cos(angle), std::sin(angle), bob_m * std::sin(kBob_rad_s * time.seconds()))};
  }
  [[nodiscard]] LaserScan scan(Time stamp) const {
    LaserScan scan;
    scan.stamp = stamp;
    scan.angle_min_rad = -2.35, scan.angle_increment_rad = 4.7 / 540;
    scan.time_increment_s = 0.02 / 541;
    scan.range_min_m = 0.1, scan.range_max_m = 30;
    for (std::size_t i = 0; i < 541; ++i) {
      const SE3 T = T_world_base(scan.stamp_of(i));
      const double angle = scan.angle_rad(i);
      scan.ranges_m.push_back(static_cast<float>(
          range_in_room(T.translation(), T.rotation() * Vec3(std::cos(angle), std::sin(angle), 0))));
    }
    return scan;
  }
  [[nodiscard]] ImuSample imu(Time stamp) const {
    ImuSample sample;
    sample.stamp = stamp;
    const Duration step{100'000};
    const Mat3 R = T_world_base(stamp).rotation();
    sample.angular_velocity_rad_s =
        so3_log(T_world_base(stamp - step).rotation().transpose() * T_world_base(stamp + step).rotation()) /
        (2 * step.seconds());
    sample.R_world_imu = R;
    sample.specific_force_m_s2 =
        R.transpose() * (Vec3(0, 0, kGravity_m_s2) - Vec3(turn_rad_s, turn_rad_s, kBob_rad_s)
                                                         .cwiseAbs2()
                                                         .cwiseProduct(T_world_base(stamp).translation()));
    return sample;
  }
};

LaserPlatform platform(bool imu, bool odometry = false) { return {{LaserRig{}}, imu, odometry}; }

double worst_position_error_m(const Flight& flight, const std::vector<LaserStep>& steps) {
  double worst = 0;
  const SE3 T_world_odom =
      flight.T_world_base(steps.front().stamp) * steps.front().T_odom_base.value().inverse();
  // The frame `odom` is level: only the heading of the first pose counts.
  const SE3 level = SE2::from_se3(T_world_odom).to_se3();
  for (const LaserStep& step : steps)
    worst = std::max(worst, (level * step.T_odom_base.value().translation() -
                             flight.T_world_base(step.stamp).translation())
                                .norm());
  return worst;
}

std::vector<LaserStep> fly(const Flight& flight, LaserPipeline& pipeline, double duration_s, bool imu) {
  std::int64_t next_scan_ns = 100'000'000;
  for (std::int64_t ns = 0; ns < static_cast<std::int64_t>(duration_s * 1e9); ns += 5'000'000) {
    if (imu) pipeline.add_imu(flight.imu(Time{ns}));
    if (ns < next_scan_ns) continue;
    pipeline.add_scan(flight.scan(Time{next_scan_ns}));
    next_scan_ns += 50'000'000;
  }
  pipeline.finish();
  return pipeline.take_steps();
}

TEST(LaserPipeline, FollowsACircleInARoomAndMapsItsWalls) {
  const Flight flight;
  LaserPipeline pipeline({}, platform(false));
  const auto steps = fly(flight, pipeline, 10, false);
  ASSERT_EQ(steps.size(), 198U);
  for (const LaserStep& step : steps) ASSERT_EQ(step.status, LaserScanStatus::kPosed) << step.reason;
  EXPECT_LT(worst_position_error_m(flight, steps), 0.02);
  const SE3 T_odom_world =
      steps.front().T_odom_base.value() * flight.T_world_base(steps.front().stamp).inverse();
  const auto state = [&](double x, double y) { return pipeline.map().at(T_odom_world * Vec3(x, y, 0)); };
  EXPECT_EQ(state(0, 0), Occupancy::kFree);
  EXPECT_EQ(state(2.5, -1.5), Occupancy::kFree);
  EXPECT_EQ(state(kHalfLength_m + 0.5, 0), Occupancy::kUnknown);
  int walls = 0;
  for (double y = -2.5; y <= 2.5; y += 0.1) walls += state(kHalfLength_m, y) == Occupancy::kOccupied ? 1 : 0;
  EXPECT_GE(walls, 45);
}

/// A recorder stamps scans when they arrive; wheels are on time.
TEST(LaserPipeline, LearnsHowLateScansAreStamped) {
  Flight flight;
  flight.swing_rad = 0.6;
  for (const double late_s : {0.0, 0.16}) {
    LaserPipeline pipeline({}, platform(false, true));
    for (int i = 0; i < 500; ++i) {
      const Time now = Time::from_seconds(1 + 0.04 * i);
      pipeline.add_odometry({now, flight.T_world_base(now)});
      if (i % 2 > 0) continue;
      LaserScan scan = flight.scan(now - Duration::from_seconds(late_s));
      scan.stamp = now;
      pipeline.add_scan(std::move(scan));
    }
    pipeline.finish();
    EXPECT_NEAR(pipeline.odometry_delay().seconds(), late_s, 0.021);
  }
}

/// One wrong reading once moved the whole path after it by twice its error: `corrected()` turns the way back.
TEST(LaserPipeline, DoesWithoutOdometryWhereItJumps) {
  struct Case {
    double shift_m;
    int first, last;
  };
  for (const Case& fault : {Case{50, 200, 200}, Case{1e200, 200, 200}, Case{5, 200, 500}}) {
    const Flight flight;
    LaserPipeline pipeline({}, platform(false, true));
    for (int i = 0; i < 500; ++i) {
      const Time now = Time::from_seconds(1 + 0.04 * i);
      StampedPose reading{now, flight.T_world_base(now)};
      if (i >= fault.first && i <= fault.last)
        reading.T_world_base = SE3(Mat3::Identity(), Vec3(fault.shift_m, 0, 0)) * reading.T_world_base;
      pipeline.add_odometry(reading);
      if (i % 2 == 0) pipeline.add_scan(flight.scan(now));
    }
    pipeline.finish();
    const auto steps = pipeline.take_steps();
    ASSERT_EQ(steps.size(), 250U);
    for (const LaserStep& step : steps) ASSERT_EQ(step.status, LaserScanStatus::kPosed) << step.reason;
    EXPECT_LT(worst_position_error_m(flight, steps), 0.02) << fault.shift_m;
  }
}

TEST(LaserPipeline, TiltIsTakenFromTheImuBeamByBeam) {
  Flight flight;
  flight.tilt_rad = 0.2;
  LaserPipeline with({}, platform(true));
  const auto steps = fly(flight, with, 10, true);
  std::size_t posed = 0;
  for (const LaserStep& step : steps) posed += step.status == LaserScanStatus::kPosed ? 1 : 0;
  ASSERT_EQ(posed, steps.size());
  EXPECT_LT(worst_position_error_m(flight, steps), 0.03);
  for (const LaserStep& step : steps) {
    const Vec3 truth = roll_pitch_yaw(flight.T_world_base(step.stamp).rotation());
    const Vec3 found = roll_pitch_yaw(step.T_odom_base->rotation());
    EXPECT_NEAR(found.x(), truth.x(), 0.01);
    EXPECT_NEAR(found.y(), truth.y(), 0.01);
  }
  ASSERT_TRUE(steps.back().state);
  // The walls stand upright: what is hit above and below the vehicle lies as far out as what is hit level.
  EXPECT_GT(with.map().bounds().sizes().z(), 0.8);
  const Vec3 size = with.map().bounds().sizes();
  EXPECT_LT(size.head<2>().norm(), std::hypot(2 * kHalfLength_m, 2 * kHalfWidth_m) + 1.0);
  // Without the IMU the same flight is bent.
  LaserPipeline without({}, platform(false));
  EXPECT_GT(worst_position_error_m(flight, fly(flight, without, 10, false)), 0.05);
}

/// A sensor beneath the base that leans by 0.1 rad, over a floor 1.5 m down, and 0.3 m higher beyond x = 0.3.
constexpr double kFloorDepth_m = 1.5, kFloorStep_m = 0.3, kFloorEdge_m = 0.3;
SE3 range_mount() {
  return {rotation_from_roll_pitch_yaw(Vec3(0, std::numbers::pi / 2 - 0.1, 0)), Vec3(0.1, 0, -0.05)};
}
RangeReading range_below(const Flight& flight, Time stamp, double noise_m) {
  const SE3 T = flight.T_world_base(stamp) * range_mount();
  const Vec3 from = T.translation(), along = T.rotation() * Vec3::UnitX();
  const auto to_level = [&](double level_m) { return (level_m - from.z()) / along.z(); };
  double range_m = to_level(kFloorStep_m - kFloorDepth_m);
  if ((from + range_m * along).x() < kFloorEdge_m) range_m = to_level(-kFloorDepth_m);
  return {stamp, range_m + noise_m, 0.1, 4};
}

// Starts over the higher floor, which is the reference; of ten readings three are no height.
TEST(LaserPipeline, ARangeSensorMeasuresTheHeightOverSteps) {
  Flight flight;
  flight.tilt_rad = 0.1, flight.bob_m = 0.25;
  LaserRig rig;
  rig.T_base_range = range_mount();
  LaserPipeline pipeline({}, {{rig}, true, false});
  ASSERT_TRUE(pipeline.uses_range() && pipeline.measures_height());
  Rng rng(5);
  std::size_t readings = 0, lost = 0;
  for (std::int64_t ms = 0; ms < 30'000; ms += 5) {
    const Time now{ms * 1'000'000};
    pipeline.add_imu(flight.imu(now));
    if (ms % 40 == 0) {
      RangeReading reading = range_below(flight, now, rng.normal(0, 0.01));
      const double bad[3] = {std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::infinity(), 0.05};
      if (const std::size_t turn = readings++ % 10; turn >= 4 && turn < 7)
        ++lost, reading.range_m = bad[turn - 4];
      pipeline.add_range(reading);
    }
    if (ms >= 100 && ms % 50 == 0) pipeline.add_scan(flight.scan(now));
  }
  pipeline.finish();
  EXPECT_EQ(pipeline.range_counts().processed, readings);
  EXPECT_EQ(pipeline.range_counts().used, readings - lost);
  double worst_m = 0, squared = 0;
  const auto steps = pipeline.take_steps();
  for (const LaserStep& step : steps) {
    ASSERT_EQ(step.status, LaserScanStatus::kPosed) << step.reason;
    const double truth_m = kFloorDepth_m - kFloorStep_m + flight.T_world_base(step.stamp).translation().z();
    const double error_m = std::abs(step.T_odom_base->translation().z() - truth_m);
    worst_m = std::max(worst_m, error_m);
    squared += error_m * error_m;
  }
  RecordProperty("worst_mm", static_cast<int>(1000 * worst_m));
  RecordProperty("rmse_mm", static_cast<int>(1000 * std::sqrt(squared / static_cast<double>(steps.size()))));
  EXPECT_LT(std::sqrt(squared / static_cast<double>(steps.size())), 0.02);
  EXPECT_LT(worst_m, 0.05);
  const auto floors = pipeline.floors();
  ASSERT_EQ(floors.size(), 2U);
  EXPECT_NEAR(floors[0].level_m, -kFloorStep_m, 0.03);
}

TEST(LaserPipeline, ARangeSensorThatMeasuresNoHeightIsNotUsed) {
  LaserRecording recording;
  recording.lasers.emplace_back();
  const auto uses = [&] { return LaserPipeline({}, laser_platform(recording)).uses_range(); };
  recording.range.T_base_range = range_mount();
  recording.range.readings = {{Time{1}, 0.05, 0.1, 4},
                              {Time{2}, std::numeric_limits<double>::infinity(), 0.1, 4}};
  EXPECT_FALSE(uses()) << "no reading within the limits";
  recording.range.readings.push_back({Time{3}, 1, 0.1, 4});
  recording.range.T_base_range.reset();
  EXPECT_FALSE(uses()) << "its mount is unknown";
  recording.range.T_base_range = SE3();
  EXPECT_FALSE(uses()) << "it looks ahead";
  recording.range.T_base_range = range_mount();
  EXPECT_TRUE(uses());
  recording.rig = LaserRig{};
  recording.rig->down = LaserRig::Mirror{{0, 20}, {}};
  EXPECT_FALSE(uses()) << "a mirror comes first";
}

TEST(LaserPipeline, WithoutAReadingNoScanIsMappedAtAWrongHeight) {
  const Flight flight;
  LaserRig rig;
  rig.T_base_range = range_mount();
  LaserPipeline pipeline({}, {{rig}, false, false});
  for (const LaserStep& step : fly(flight, pipeline, 1, false))
    EXPECT_EQ(step.status, LaserScanStatus::kNoHeight);
  EXPECT_EQ(pipeline.map().size().volumes_positive, 0U);
}

TEST(LaserPipeline, AScanWaitsForTheImuButNotForever) {
  const Flight flight;
  LaserPipeline pipeline({}, platform(true));
  pipeline.add_imu(flight.imu(Time{0}));
  pipeline.add_scan(flight.scan(Time{10'000'000}));
  EXPECT_TRUE(pipeline.take_steps().empty());
  pipeline.add_imu(flight.imu(Time{20'000'000}));  // the sweep lasts until 30 ms
  EXPECT_TRUE(pipeline.take_steps().empty());
  pipeline.add_imu(flight.imu(Time{40'000'000}));
  EXPECT_EQ(pipeline.take_steps().size(), 1U);
  // The IMU falls silent: scans go on after max_wait_s.
  for (const int ms : {100, 200, 300}) pipeline.add_scan(flight.scan(Time{ms * std::int64_t{1'000'000}}));
  EXPECT_TRUE(pipeline.take_steps().empty());
  pipeline.add_scan(flight.scan(Time{400'000'000}));
  EXPECT_EQ(pipeline.take_steps().size(), 1U);
  pipeline.finish();
  EXPECT_EQ(pipeline.take_steps().size(), 3U);
}

TEST(LaserPipeline, AnUprightLaserBuildsTheMapFromOdometry) {
  LaserRig rig;
  rig.T_base_laser = SE3(rotation_from_roll_pitch_yaw({std::numbers::pi / 2, 0, 0}), Vec3(0, 0, 1));
  ASSERT_FALSE(scans_horizontally(rig));
  LaserPipeline pipeline({}, {{rig}, false, true});
  EXPECT_FALSE(pipeline.matches_scans());
  LaserScan scan;
  scan.range_min_m = 0.1, scan.range_max_m = 10;
  scan.ranges_m = {2.0F};  // one beam, forward, 1 m over the base
  for (int i = 0; i < 5; ++i) {
    pipeline.add_odometry(
        {Time{i * std::int64_t{1'000'000'000}}, SE3(Mat3::Identity(), Vec3(0, 0.5 * i, 0))});
    scan.stamp = Time{i * std::int64_t{1'000'000'000} + 500'000'000};
    pipeline.add_scan(scan);
  }
  pipeline.finish();
  const auto steps = pipeline.take_steps();
  ASSERT_EQ(steps.size(), 5U);
  for (std::size_t i = 0; i < 4; ++i) {
    ASSERT_EQ(steps[i].status, LaserScanStatus::kPosed);
    EXPECT_NEAR(steps[i].T_odom_base->translation().y(), 0.5 * static_cast<double>(i) + 0.25, 1e-12);
    EXPECT_EQ(pipeline.map().at(steps[i].T_odom_base.value() * Vec3(2.0, 0, 1)), Occupancy::kOccupied);
    EXPECT_EQ(pipeline.map().at(steps[i].T_odom_base.value() * Vec3(2.0, 0, 0)), Occupancy::kUnknown);
  }
  EXPECT_EQ(steps[4].status, LaserScanStatus::kNoOdometry);
  EXPECT_FALSE(steps[4].T_odom_base);
}

TEST(LaserPipeline, ScansThatRunBackwardsOrShowNothingAreNamed) {
  const Flight flight;
  LaserPipeline pipeline({}, platform(false));
  LaserScan empty = flight.scan(Time{3'000'000'000});
  for (float& range : empty.ranges_m) range = LaserScan::kNoReturn;
  pipeline.add_scan(flight.scan(Time{2'000'000'000}));
  pipeline.add_scan(flight.scan(Time{1'000'000'000}));
  pipeline.add_scan(empty);
  const auto steps = pipeline.take_steps();
  ASSERT_EQ(steps.size(), 3U);
  EXPECT_EQ(steps[0].status, LaserScanStatus::kPosed);
  EXPECT_EQ(steps[1].status, LaserScanStatus::kTimeBackwards);
  EXPECT_EQ(steps[2].status, LaserScanStatus::kNotProjected);
  for (const std::size_t i : {1U, 2U}) EXPECT_FALSE(steps[i].reason.empty());
}

TEST(SweepPoints, EveryBeamFromItsOwnPose) {
  // A vehicle at 2 m/s that turns at 3 rad/s sees a wall at x = 5; ranges in closed form.
  const auto pose = [](Time time) -> std::optional<SE3> {
    const double t = time.seconds();
    return SE3(rotation_from_roll_pitch_yaw({0, 0, 3 * t}), Vec3(2 * t, 0, 0.7));
  };
  LaserScan scan;
  scan.angle_min_rad = -0.5, scan.angle_increment_rad = 1.0 / 200;
  scan.time_increment_s = 0.02 / 200;
  scan.range_min_m = 0.1, scan.range_max_m = 30;
  for (std::size_t i = 0; i < 201; ++i) {
    const double t = scan.stamp_of(i).seconds();
    scan.ranges_m.push_back(static_cast<float>((5 - 2 * t) / std::cos(scan.angle_rad(i) + 3 * t)));
  }
  scan.ranges_m[7] = LaserScan::kNoReturn;
  scan.ranges_m[8] = LaserScan::kInvalid;
  SweepPoints points(4.0);
  ASSERT_TRUE(points.compute(scan, {}, pose));
  ASSERT_EQ(points.beam_scan().p_world_returns.size(), 199U);
  for (const auto& point : points.beam_scan().p_world_returns) {
    // Poses are interpolated over 64 beams, 19 mrad: a chord is 5 m (19 mrad)^2 / 8 from its arc.
    EXPECT_NEAR(point.x(), 5, 2.5e-4);
    EXPECT_NEAR(point.z(), 0.7, 1e-6);
  }
  ASSERT_EQ(points.beam_scan().p_world_no_returns.size(), 1U);
  EXPECT_NEAR(points.beam_scan().p_world_no_returns[0].head<2>().norm(), 4, 0.01);
  EXPECT_FALSE(points.compute(scan, {}, [](Time) { return std::optional<SE3>(); }));
}

TEST(LaserEvents, AreMergedInOrderOfTheirArrival) {
  LaserRecording recording;
  recording.lasers.emplace_back();
  for (const int ms : {0, 100, 200}) {
    LaserScan scan;
    scan.stamp = Time{ms * std::int64_t{1'000'000}};
    scan.time_increment_s = 0.01;
    scan.ranges_m.assign(5, 1.0F);  // a sweep of 50 ms
    recording.lasers[0].scans.push_back(scan);
  }
  for (int ms = 10; ms < 260; ms += 40) {
    ImuSample sample;
    sample.stamp = Time{ms * std::int64_t{1'000'000}};
    recording.imu.push_back(sample);
  }
  const LaserPipeline pipeline({}, platform(true));
  const LaserEvents events(recording, pipeline, {});
  ASSERT_EQ(events.all().size(), 10U);
  EXPECT_TRUE(std::is_sorted(events.all().begin(), events.all().end(),
                             [](const LaserEvent& a, const LaserEvent& b) { return a.due < b.due; }));
  EXPECT_EQ(events.scan_count(), 3U);
  EXPECT_EQ(events.scans_between(Time{50'000'000}, Time{250'000'000}), 2U);
  EXPECT_EQ(events.scans_between(Time{250'000'000}, Time{50'000'000}), 0U);
  LaserRunParams part;
  part.begin_s = 0.1, part.duration_s = 0.1;  // from 110 ms to 210 ms
  const LaserEvents fewer(recording, pipeline, part);
  EXPECT_EQ(fewer.scan_count(), 1U);
  EXPECT_EQ(fewer.begin().ns, 130'000'000);
  EXPECT_EQ(fewer.end().ns, 210'000'000);
  LaserRunParams thinned;
  thinned.scan_stride = 2;
  const LaserEvents half(recording, pipeline, thinned);
  EXPECT_EQ(half.scan_count(), 2U);  // the first and the third
  EXPECT_EQ(half.all().size(), 9U);  // nothing else is left out
}

TEST(LaserScanCounts, HeightErrorLeavesOutAConstant) {
  Trajectory truth;
  const Trajectory truth_of_nothing;
  std::vector<LaserScanRecord> records;
  LaserScanCounts counts(truth), without_truth(truth_of_nothing);
  for (int i = 0; i <= 100; ++i) {
    const Time stamp{i * std::int64_t{50'000'000}};
    truth.push_back({stamp, SE3(Mat3::Identity(), Vec3(0, 0, 7.5 + 0.01 * i))});
    LaserScanRecord record;
    record.step.height = HeightEstimate{};
    record.step.height->stamp = stamp;
    record.step.height->status = i % 10 == 9 ? HeightStatus::kTilted : HeightStatus::kOk;
    record.step.height->height_m = i % 10 == 9 ? 99 : 0.01 * i + (i % 2 == 0 ? 0.02 : -0.02);
    records.push_back(record);
  }
  for (const LaserScanRecord& record : records) counts.add(record), without_truth.add(record);
  const auto error = counts.height_error();
  ASSERT_TRUE(error);
  EXPECT_EQ(error->pairs, 91U);
  EXPECT_NEAR(error->offset_m, 7.48, 1e-9);  // more even ones than odd ones: their offset is the median
  EXPECT_NEAR(error->max_m, 0.04, 1e-9);
  EXPECT_FALSE(without_truth.height_error());
}

}  // namespace
}  // namespace hm
