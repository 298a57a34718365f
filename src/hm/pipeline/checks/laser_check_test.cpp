#include "hm/pipeline/checks/laser_check.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "hm/core/rng.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/pipeline/checks/preflight.hpp"

namespace hm {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kDegree = std::numbers::pi / 180;

Time at(double seconds) { return Time::from_seconds(1000 + seconds); }

/// Twenty scans at 10 Hz of 90 beams, a degree apart; every tenth beam sees nothing.
LaserStream stream() {
  Rng rng(1);
  LaserStream laser{.name = "/scan"};
  for (int i = 0; i < 20; ++i) {
    LaserScan scan;
    scan.stamp = at(0.1 * i);
    scan.angle_min_rad = -45 * kDegree;
    scan.angle_increment_rad = kDegree;
    scan.range_max_m = 30;
    for (int b = 0; b < 90; ++b)
      scan.ranges_m.push_back(b % 10 == 0 ? LaserScan::kNoReturn : static_cast<float>(rng.uniform(1, 9)));
    laser.received.push_back(scan.stamp + Duration::from_seconds(i == 7 ? 0.05 : 0.02));
    laser.scans.push_back(scan);
  }
  laser.no_returns = 180;
  laser.sentinels_m = {{LaserScan::kNoReturn, 180}};
  return laser;
}

LaserRecording recording() {
  LaserRecording made;
  made.lasers.push_back(stream());
  for (int i = 0; i < 20; ++i)
    made.odometry.push_back({at(0.1 * i), SE3(Mat3::Identity(), Vec3(0.05 * i, 0, 0))});
  return made;
}

/// The words of all findings of a kind.
std::string findings(const LaserRecordingReport& report, LaserFindingKind kind) {
  std::string words;
  for (const LaserFinding& finding : report.findings)
    if (finding.kind == kind) words += finding.message + "\n";
  return words;
}

TEST(LaserCheck, SoundRecording) {
  const LaserRecordingReport report = inspect_laser_recording(recording());
  ASSERT_EQ(report.lasers.size(), 1U);
  const LaserStreamStats& laser = report.lasers[0];
  EXPECT_EQ(laser.stream.count, 20U);
  EXPECT_NEAR(laser.stream.rate_hz, 10, 1e-6);
  EXPECT_EQ(laser.beams, 90U);
  EXPECT_NEAR(laser.angle_max_rad, 44 * kDegree, 1e-12);
  EXPECT_NEAR(laser.returns_ratio, 0.9, 1e-12);
  EXPECT_NEAR(laser.no_returns_ratio, 0.1, 1e-12);
  EXPECT_NEAR(laser.median_m, 5, 0.5);
  EXPECT_NEAR(*laser.latency_s, 0.02, 1e-9);
  EXPECT_NEAR(*laser.max_latency_s, 0.05, 1e-9);
  EXPECT_EQ(laser.repeated_ratio, 0);
  EXPECT_NEAR(report.odometry_length_m, 0.95, 1e-9);
  EXPECT_THAT(report.findings, IsEmpty());
  EXPECT_THAT(to_text(report), HasSubstr("looks right"));
}

TEST(LaserCheck, JsonHoldsEverything) {
  const auto json = parse_json(to_json_text(to_json(inspect_laser_recording(recording()))), "report");
  ASSERT_TRUE(json);
  const auto* lasers = json->find("lasers")->as_array();
  ASSERT_EQ(lasers->size(), 1U);
  const JsonValue& laser = lasers->at(0);
  EXPECT_EQ(laser.find("beams")->number_or(0), 90);
  const JsonValue& sentinel = laser.find("sentinels")->as_array()->at(0);
  EXPECT_EQ(*sentinel.find("range_m")->as_string(), "inf");  // infinity is no JSON number
  EXPECT_EQ(sentinel.find("count")->number_or(0), 180);
  EXPECT_TRUE(json->find("imu")->is_null());
  EXPECT_NEAR(json->find("odometry")->find("path_length_m")->number_or(0), 0.95, 1e-9);
}

TEST(LaserCheck, BeamsThatCannotStandSo) {
  LaserRecording made = recording();
  made.lasers[0].scans[3].ranges_m.resize(80);
  EXPECT_THAT(findings(inspect_laser_recording(made), LaserFindingKind::kAngles),
              HasSubstr("from 80 to 90 beams"));
  made = recording();
  for (LaserScan& scan : made.lasers[0].scans) scan.angle_increment_rad = 4.2 * kDegree;
  EXPECT_THAT(findings(inspect_laser_recording(made), LaserFindingKind::kAngles), HasSubstr("373.8 degrees"));
}

TEST(LaserCheck, RangesInMillimetresAreRefusedBeforeARun) {
  LaserRecording made = recording();
  EXPECT_TRUE(check_before_laser_run(made, false));
  for (LaserScan& scan : made.lasers[0].scans) {
    scan.range_max_m *= 1000;
    for (float& range : scan.ranges_m) range *= 1000;
  }
  EXPECT_THAT(findings(inspect_laser_recording(made), LaserFindingKind::kRangeUnits),
              HasSubstr("are the ranges in millimetres?"));
  const auto refused = check_before_laser_run(made, false);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("are the ranges in millimetres? Nothing was made of it"));
  EXPECT_THAT(refused.error().message, HasSubstr("--force"));
  const auto forced = check_before_laser_run(made, true);
  ASSERT_TRUE(forced);
  EXPECT_THAT(*forced, ::testing::Contains(HasSubstr("millimetres")));
}

TEST(LaserCheck, HeadingsInDegreesAreNamed) {
  const auto of_headings = [](double step, double interval_s) {
    LaserRecording made = recording();
    for (int i = 0; i < 100; ++i) made.written_headings.push_back({at(interval_s * i), step * i});
    return findings(inspect_laser_recording(made), LaserFindingKind::kOdometry);
  };
  EXPECT_THAT(of_headings(0.1, 0.1), IsEmpty());  // turns on and on, by 1 rad/s
  EXPECT_THAT(of_headings(1.5, 2), IsEmpty());
  EXPECT_THAT(of_headings(0.1 / kDegree, 3), HasSubstr("headings of the odometry look like degrees"));
  EXPECT_THAT(of_headings(0.02 / kDegree, 0.02), HasSubstr("look like degrees"));
}

TEST(LaserCheck, ClocksThatDiffer) {
  LaserRecording made = recording();
  for (Time& received : made.lasers[0].received) received = received + Duration::from_seconds(3600);
  EXPECT_THAT(findings(inspect_laser_recording(made), LaserFindingKind::kStamps),
              HasSubstr("3600.020 s after"));
  made = recording();
  for (StampedPose& pose : made.odometry) pose.stamp = pose.stamp + Duration::from_seconds(10);
  EXPECT_THAT(findings(inspect_laser_recording(made), LaserFindingKind::kStamps),
              HasSubstr("odometry and scans do not overlap in time: they are 8.100 s"));
}

TEST(LaserCheck, WhatTheReaderToldIsPassedOn) {
  LaserRecording made = recording();
  made.damage = {"the chunk at byte 9 is damaged"};
  made.skipped = {{SkippedLines::Reason::kStampNotIncreasing, "/scan", 3, 7, "message"},
                  {SkippedLines::Reason::kNotFinite, "/imu", 1, 2, "message"}};
  const LaserRecordingReport report = inspect_laser_recording(made);
  EXPECT_THAT(findings(report, LaserFindingKind::kDamage), HasSubstr("byte 9"));
  EXPECT_THAT(findings(report, LaserFindingKind::kDamage), HasSubstr("/imu"));
  EXPECT_THAT(findings(report, LaserFindingKind::kStamps), HasSubstr("3 messages of /scan"));
}

/// An IMU that shakes for two seconds, rests for one with a bias, and shakes again.
std::vector<ImuSample> shaken_imu(double force_at_rest, double bias_rad_s) {
  Rng rng(2);
  std::vector<ImuSample> imu;
  for (int i = 0; i < 500; ++i) {
    const bool rests = i >= 200 && i < 300;
    ImuSample sample;
    sample.stamp = at(0.01 * i);
    const auto noise = [&](double size) -> Vec3 {
      return Vec3(rng.normal(), rng.normal(), rng.normal()) * size;
    };
    sample.specific_force_m_s2 = Vec3(0, 0, force_at_rest) + noise((rests ? 0.001 : 0.3) * force_at_rest);
    sample.angular_velocity_rad_s = Vec3(bias_rad_s, 0, 0) + noise(rests ? 0.001 : 2);
    imu.push_back(sample);
  }
  return imu;
}

TEST(LaserCheck, TheStillestHalfSecondShowsUnitsAndBias) {
  LaserRecording made = recording();
  made.imu = shaken_imu(9.81, 0.02);
  const LaserRecordingReport right = inspect_laser_recording(made);
  ASSERT_TRUE(right.imu);
  EXPECT_NEAR(right.imu->still_force_m_s2, 9.81, 0.01);
  EXPECT_NEAR(right.imu->still_turning_rad_s, 0.02, 0.001);
  EXPECT_THAT(findings(right, LaserFindingKind::kImuUnits), IsEmpty());
  made.imu = shaken_imu(1.0, 0);
  EXPECT_THAT(findings(inspect_laser_recording(made), LaserFindingKind::kImuUnits), HasSubstr("in g"));
  made.imu = shaken_imu(11, 0);
  EXPECT_THAT(findings(inspect_laser_recording(made), LaserFindingKind::kImuUnits), HasSubstr("11"));
  made.imu = shaken_imu(9.81, 1.5);
  EXPECT_THAT(findings(inspect_laser_recording(made), LaserFindingKind::kImuUnits), HasSubstr("large bias"));
}

TEST(LaserCheck, AnImuOfOneSample) {
  LaserRecording made = recording();
  made.imu.resize(1);
  made.imu[0].stamp = at(0);
  made.imu[0].specific_force_m_s2 = Vec3(0, 0, 9.8);
  EXPECT_NEAR(inspect_laser_recording(made).imu->still_force_m_s2, 9.8, 1e-9);
}

}  // namespace
}  // namespace hm
