#include "hm/io/laser/laser_log.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "hm/io/rgbd/recording.hpp"
#include "hm/io/testing/io_test_support.hpp"

/// The text logs, on small ones written here.
namespace hm {
namespace {

using test::write_bytes;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class LaserLogs : public ::testing::Test {
 protected:
  LaserRecording read(const std::string& text, const std::string& name = "a.log") {
    write_bytes(folder_ / name, text);
    auto recording = open_laser_recording(folder_ / name);
    EXPECT_TRUE(recording) << to_string(recording.error());
    return recording ? *recording : LaserRecording{};
  }
  TemporaryFolder folder_;
};

std::string repeated(const std::string& text, int count) {
  std::string result;
  for (int i = 0; i < count; ++i) result += text;
  return result;
}

void expect_planar(const SE3& pose, double x_m, double y_m, double angle_rad) {
  const SE2 planar = SE2::from_se3(pose);
  EXPECT_NEAR(planar.x(), x_m, 1e-9);
  EXPECT_NEAR(planar.y(), y_m, 1e-9);
  EXPECT_NEAR(planar.angle(), angle_rad, 1e-9);
  EXPECT_EQ(pose.translation().z(), 0);
}

/// FLASER with a laser pose 0.2 m before the robot.
std::string flaser(double x, double stamp, const std::string& first_range = "1.5") {
  return fmt::format("FLASER 180 {} {}{} 0 0 {} 0 0 {} host {}\n", first_range, repeated("2.25 ", 179),
                     x + 0.2, x, stamp, stamp - 100);
}

TEST_F(LaserLogs, CarmenOldFrontLaser) {
  const LaserRecording recording =
      read("# CARMEN Logfile\nPARAM robot_front_laser_max 50.0 1 h 1\n" + flaser(0, 100.25) +
           flaser(1, 100.5, "81.91") + flaser(2, 100.75, "50.0"));
  EXPECT_EQ(recording.kind, LaserRecordingKind::kCarmen);
  ASSERT_EQ(recording.lasers.size(), 1U);
  const LaserStream& laser = recording.lasers[0];
  EXPECT_EQ(laser.name, "FLASER");
  ASSERT_EQ(laser.scans.size(), 3U);
  EXPECT_EQ(laser.scans[1].stamp.ns, 100'500'000'000);
  EXPECT_EQ(laser.scans[0].size(), 180U);
  EXPECT_DOUBLE_EQ(laser.scans[0].angle_min_rad, -std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(laser.scans[0].angle_increment_rad, std::numbers::pi / 180);
  EXPECT_EQ(laser.scans[0].range_max_m, 50);
  EXPECT_EQ(laser.scans[0].ranges_m[0], 1.5F);
  EXPECT_EQ(laser.scans[0].ranges_m[179], 2.25F);
  EXPECT_FALSE(laser.scans[1].is_return(0));
  EXPECT_EQ(laser.no_returns, 2U);
  expect_planar(laser.T_base_laser, 0.2, 0, 0);
  ASSERT_EQ(recording.odometry.size(), 3U);
  expect_planar(recording.odometry[2].T_world_base, 2, 0, 0);
  EXPECT_TRUE(recording.truth.empty());  // the laser sits still on its robot: nothing was corrected
  EXPECT_THAT(recording.notes, IsEmpty());
}

TEST_F(LaserLogs, CarmenOddNumberOfBeamsEndsAtNinetyDegrees) {
  const LaserRecording recording =
      read("FLASER 361 " + repeated("3 ", 361) + "0 0 0 0 0 0 10.5 host 1\n", "a.clf");
  const LaserScan& scan = recording.lasers.at(0).scans.at(0);
  EXPECT_NEAR(scan.angle_rad(360), std::numbers::pi / 2, 1e-12);
}

TEST_F(LaserLogs, CarmenLinesThatAreLeftOutSayWhy) {
  const std::string ranges = repeated("2 ", 180);
  const LaserRecording recording =
      read(flaser(0, 100) + "FLASER 180 " + ranges + "\nFLASER 180 " + ranges + "7 host 7\nFLASER 180 1 2\n" +
           "RAWLASER1 0 -90 180 1 50 0.01 0 180 " + ranges + "0 8 host 8\n");
  EXPECT_THAT(recording.notes,
              ElementsAre("2 lines of a.log left out: no poses after the 180 ranges (first: a.log:2)",
                          "1 line of a.log left out: malformed (first: a.log:4)",
                          "1 line of a.log left out: angle_min is -90: degrees? (first: a.log:5)"));
}

TEST_F(LaserLogs, CarmenHeadingsAreKeptAsWritten) {
  const LaserRecording recording =
      read(flaser(0, 99) + "ODOM 1 2 90 0 0 0 100 host 100\nODOM 1 2 95 0 0 0 101 host 101\n");
  ASSERT_EQ(recording.written_headings.size(), 2U);  // of ODOM lines, which are the odometry
  EXPECT_EQ(recording.written_headings[1].heading_rad, 95);
  EXPECT_EQ(recording.written_headings[1].stamp, Time::from_seconds(101));
  EXPECT_EQ(read(flaser(0, 99) + flaser(1, 100)).written_headings.size(), 2U);
}

TEST_F(LaserLogs, CarmenCorrectedPosesAreTruth) {
  const auto line = [](double truth, double odometry, double stamp) {
    return fmt::format("FLASER 180 {}{} 1 0.5 {} 0 0 {} host 1\n", repeated("2 ", 180), truth, odometry,
                       stamp);
  };
  const LaserRecording recording = read(line(0, 0, 10) + line(1, 1.2, 11) + line(2, 2.5, 12));
  expect_planar(recording.truth.at(2).T_world_base, 2, 1, 0.5);
  expect_planar(recording.odometry.at(2).T_world_base, 2.5, 0, 0);
  EXPECT_THAT(recording.truth_source, HasSubstr("FLASER"));
}

const std::string kRobotLaser =
    "ROBOTLASER1 0 -1.5 3.0 0.5 25.0 0.01 0 6 1 2 3 4 30 0 2 55 66 "  // six ranges, two remissions
    "3.1 4 0.5 3 4 0.5 0.2 0.1 0 0 0 976052857.337284 host 700.0\n";

TEST_F(LaserLogs, CarmenNewFormat) {
  const LaserRecording recording =
      read(kRobotLaser + "RAWLASER1 0 -1.5 3.0 0.5 25.0 0.01 0 3 7 8 9 0 976052857.5 host 700.1\n" +
           "ODOM 1 2 0.25 0.5 0 0 976052857.25 host 700\nTRUEPOS 7 8 0.75 1 2 0.25 976052857.25 host "
           "700\nSYNC x\n");
  ASSERT_EQ(recording.lasers.size(), 2U);
  const LaserStream& robot = recording.lasers[recording.lasers[0].name == "ROBOTLASER1" ? 0 : 1];
  const LaserScan& scan = robot.scans.at(0);
  EXPECT_EQ(scan.stamp.ns, 976'052'857'337'284'000);
  ASSERT_EQ(scan.size(), 6U);
  EXPECT_EQ(scan.angle_min_rad, -1.5);
  EXPECT_EQ(scan.angle_increment_rad, 0.5);
  EXPECT_EQ(scan.range_max_m, 25);
  EXPECT_TRUE(scan.is_return(3));
  EXPECT_FALSE(scan.is_return(4));
  EXPECT_FALSE(scan.is_return(5));
  EXPECT_THAT(robot.sentinels_m,
              ElementsAre(std::pair<float, std::size_t>{0.F, 1}, std::pair<float, std::size_t>{30.F, 1}));
  EXPECT_NEAR(robot.T_base_laser.translation().norm(), 0.1, 1e-9);
  ASSERT_EQ(recording.odometry.size(), 1U);  // ODOM lines, not the poses of the scans
  expect_planar(recording.odometry[0].T_world_base, 1, 2, 0.25);
  ASSERT_EQ(recording.truth.size(), 1U);
  expect_planar(recording.truth[0].T_world_base, 7, 8, 0.75);
}

TEST_F(LaserLogs, GraphPosesAreTruthAndNeverOdometry) {
  const LaserRecording recording =
      read("VERTEX2 0 3 4 0.5\n" + kRobotLaser + "EDGE2 0 1 1 0 0 1 0 1 1 0 0\n#LOOP\n");
  EXPECT_EQ(recording.kind, LaserRecordingKind::kG2oLaser);
  EXPECT_EQ(recording.lasers.at(0).scans.size(), 1U);
  EXPECT_TRUE(recording.odometry.empty());
  expect_planar(recording.truth.at(0).T_world_base, 3, 4, 0.5);
}

TEST_F(LaserLogs, WeanHall) {
  const std::string beams = repeated("200 ", 178);
  const LaserRecording recording = read("L 100 200 0 125 200 0 50 8183 " + beams +
                                        "0.5\nO 110 200 0.25 0.75\n"
                                        "L 120 200 0 145 200 0 50 75 " +
                                        beams + "1.5\nL 120 200 0 145 200 0 50 75 1.75\n");
  EXPECT_EQ(recording.kind, LaserRecordingKind::kWeanHall);
  const LaserStream& laser = recording.lasers.at(0);
  ASSERT_EQ(laser.scans.size(), 2U);
  EXPECT_EQ(laser.scans[0].size(), 180U);
  EXPECT_EQ(laser.scans[0].ranges_m[0], 0.5F);
  EXPECT_FALSE(laser.scans[0].is_return(1));
  EXPECT_EQ(laser.scans[1].ranges_m[1], 0.75F);
  expect_planar(laser.T_base_laser, 0.25, 0, 0);
  ASSERT_EQ(recording.odometry.size(), 3U);
  expect_planar(recording.odometry[1].T_world_base, 1.1, 2, 0.25);
  EXPECT_EQ(recording.odometry[1].stamp.ns, 750'000'000);
  EXPECT_THAT(recording.notes, ElementsAre("1 line of a.log left out: malformed (first: a.log:4)"));
}

/// The middle beam of the left laser points left, its first beam down; the vehicle drives forwards.
TEST_F(LaserLogs, MoosMountingsAndFrames) {
  const auto scan = [](const std::string& side) {
    return "61.850 LMS_LASER_2D_" + side +
           " LMS1 "
           "ID=1,time=1225719873.501685,angRes=0.50,offset=0.00,minAngle=45.00,maxAngle=135.00,scanCount=4,"
           "Range=[5]{1.0,-1.000,-6.000,2.0,60},Reflectance=[5]{4,4,4,4,4}\n";
  };
  const LaserRecording recording =
      read("%% LOG FILE:  x.alog\n%% LOGSTART  5\n-3.4 MISSION_FILE a: b\nServerHost = x\n" + scan("LEFT") +
               scan("RIGHT") +
               "61.855 RAW_ODOMETRY_POSE p Pose=[3x1]{9,9,9},time=1225719873.5,Pitch=0,Roll=0\n"
               "61.855 ODOMETRY_POSE p "
               "Pose=[3x1]{4,18,0},Vel=[3x1]{0,1,0},time=1225719873.50,Speed=1,Pitch=0,Roll=0\n",
           "a.alog");
  EXPECT_EQ(recording.kind, LaserRecordingKind::kMoos);
  ASSERT_EQ(recording.lasers.size(), 2U);
  for (const LaserStream& laser : recording.lasers) {
    const LaserScan& read_scan = laser.scans.at(0);
    EXPECT_NEAR(read_scan.angle_rad(2), 46 * std::numbers::pi / 180, 1e-12);
    EXPECT_EQ(read_scan.stamp.ns, 1'225'719'873'501'685'000);
    EXPECT_EQ(laser.no_returns, 3U);
    EXPECT_EQ(laser.invalid, 0U);
    const double side = laser.name == "LMS_LASER_2D_LEFT" ? 1 : -1;
    const auto direction = [&](double angle_deg) -> Vec3 {
      const double angle = angle_deg * std::numbers::pi / 180;
      return laser.T_base_laser.rotation() * Vec3(std::cos(angle), std::sin(angle), 0);
    };
    EXPECT_LT((direction(90) - Vec3(0, side, 0)).norm(), 1e-12);
    EXPECT_NEAR(std::fabs(direction(45).z()), std::sqrt(0.5), 1e-12);
    EXPECT_NEAR(direction(45).x(), 0, 1e-12);
    EXPECT_LT((laser.T_base_laser.translation() - Vec3(-0.03, side * 0.27, 0.495)).norm(), 1e-12);
  }
  ASSERT_EQ(recording.odometry.size(), 1U);  // RAW_ODOMETRY_POSE is another thing
  expect_planar(recording.odometry[0].T_world_base, 4, 18,
                std::numbers::pi / 2);  // ahead is +y in that data set
}

std::string breezy(int stamp_us, int left, int right, const std::string& first = "1500") {
  return fmt::format("{} 0 {} {} {}{} {}\n", stamp_us, left, right, repeated("7 ", 21), first,
                     repeated("2000 ", 681));
}

TEST_F(LaserLogs, BreezyWheelOdometry) {
  // Both wheels a turn: straight on by 2 pi r. Then the wheels turn against each other.
  const LaserRecording recording =
      read(breezy(1'000'000, 0, 0) + breezy(1'100'000, 2000, 2000, "0") + breezy(1'200'000, 1000, 3000, "7"),
           "a.dat");
  EXPECT_EQ(recording.kind, LaserRecordingKind::kBreezySlam);
  const LaserStream& laser = recording.lasers.at(0);
  ASSERT_EQ(laser.scans.size(), 3U);
  ASSERT_EQ(laser.scans[0].size(), 682U);
  EXPECT_EQ(laser.scans[0].ranges_m[0], 1.5F);
  EXPECT_EQ(laser.scans[0].stamp.ns, 1'000'000'000);
  EXPECT_NEAR(laser.scans[0].angle_rad(681), -laser.scans[0].angle_min_rad, 1e-12);
  EXPECT_NEAR((laser.scans[0].stamp_of(681) - laser.scans[0].stamp).seconds(), 0.0665, 1e-4);
  EXPECT_EQ(laser.no_returns, 1U);
  EXPECT_EQ(laser.invalid, 1U);  // 7 mm is an error code of the scanner
  const double turn_m = 2 * std::numbers::pi * 0.077;
  expect_planar(recording.odometry.at(1).T_world_base, turn_m, 0, 0);
  expect_planar(recording.odometry.at(2).T_world_base, turn_m, 0, turn_m / 0.33);
}

TEST_F(LaserLogs, EurocImuWithTruth) {
  const std::string imu =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y\n1403715523912140000,1,2,3,4,5,9.81\n"
      "1403715523917140000,1,2,3,4,5,nan\r\n1403715523922140001,-1,2,3,4,5,6\n14037155";
  const std::string truth =
      "#timestamp, p_RS_R_x\n1403715523912140000,1,2,3,1,0,0,0,9,9,9\n1403715523912140000,1,2,3,1,0,0,0\n"
      "1403715523912150000,1,2,3,0,0,0,0\n";
  for (const std::string layout : {"", "mav0/"}) {
    const std::filesystem::path folder = folder_ / (layout.empty() ? "flat" : "tree");
    const auto imu_path = folder / (layout.empty() ? "imu0.csv" : "mav0/imu0/data.csv");
    const auto truth_path =
        folder / (layout.empty() ? "gt0.csv" : "mav0/state_groundtruth_estimate0/data.csv");
    std::filesystem::create_directories(imu_path.parent_path());
    std::filesystem::create_directories(truth_path.parent_path());
    write_bytes(imu_path, imu);
    write_bytes(truth_path, truth);
    const auto recording = open_laser_recording(folder);
    ASSERT_TRUE(recording) << to_string(recording.error());
    EXPECT_EQ(recording->kind, LaserRecordingKind::kEurocImu);
    ASSERT_EQ(recording->imu.size(), 2U);
    EXPECT_EQ(recording->imu[1].stamp.ns, 1'403'715'523'922'140'001);  // beyond a double's digits
    EXPECT_EQ(recording->imu[0].angular_velocity_rad_s, Vec3(1, 2, 3));
    EXPECT_EQ(recording->imu[0].specific_force_m_s2, Vec3(4, 5, 9.81));
    ASSERT_EQ(recording->truth.size(), 1U);
    EXPECT_EQ(recording->truth[0].T_world_base.rotation(), Mat3::Identity());  // the real part comes first
    EXPECT_EQ(recording->skipped.size(), 4U);
  }
}

TEST_F(LaserLogs, WhatIsNone) {
  write_bytes(folder_ / "a.txt", "1 2 3\nhello\n");
  write_bytes(folder_ / "b.g2o", "VERTEX2 0 1 2 3\nVERTEX2 1 1 2 3\nEDGE2 0 1\n");
  write_bytes(folder_ / "c.log", "");
  write_bytes(folder_ / "d.log", std::string("FLASER\0\1", 8));
  for (const std::string name : {"a.txt", "b.g2o", "c.log", "d.log", "none"}) {
    EXPECT_FALSE(is_laser_recording(folder_ / name)) << name;
    const auto recording = open_laser_recording(folder_ / name);
    ASSERT_FALSE(recording) << name;
    EXPECT_THAT(recording.error().where, HasSubstr(name));
  }
  const auto folder = open_laser_recording(folder_ / ".");
  ASSERT_FALSE(folder);
  EXPECT_THAT(folder.error().message, HasSubstr("CARMEN"));
}

TEST_F(LaserLogs, AFolderWithOneLogIsThatLog) {
  write_bytes(folder_ / "a.log", kRobotLaser);
  write_bytes(folder_ / "groundtruth.txt", "976052857.0 1 2 3 0 0 0 1\n976052858.0 1 2 3 0 0 0 1\n");
  write_bytes(folder_ / "rig.toml", "[laser]\nxyz_m = [0, 0, 0.5]\n");
  const auto recording = open_laser_recording(folder_ / ".");
  ASSERT_TRUE(recording) << to_string(recording.error());
  EXPECT_EQ(recording->truth.size(), 2U);
  EXPECT_EQ(recording->truth_source, "groundtruth.txt");
  ASSERT_TRUE(recording->rig);
  EXPECT_EQ(recording->lasers.at(0).T_base_laser.translation().z(), 0.5);

  write_bytes(folder_ / "groundtruth.txt", "976052857.0 1 2 3\n");
  const auto without_truth = open_laser_recording(folder_ / ".");
  ASSERT_TRUE(without_truth) << to_string(without_truth.error());
  EXPECT_TRUE(without_truth->truth.empty());
  EXPECT_THAT(without_truth->notes, ::testing::Contains(HasSubstr("groundtruth.txt:1: 4 columns")));

  write_bytes(folder_ / "b.log", kRobotLaser);
  const auto two = open_laser_recording(folder_ / ".");
  ASSERT_FALSE(two);
  EXPECT_THAT(two.error().message,
              HasSubstr("2 laser recordings in this folder (a.log, b.log): name one, as "));
  const auto as_images = open_recording(folder_ / ".");
  ASSERT_FALSE(as_images);
  EXPECT_EQ(as_images.error().message, two.error().message);
  const auto first = open_laser_recording(folder_ / "a.log");
  ASSERT_TRUE(first);
  EXPECT_TRUE(first->truth.empty());  // ambiguous which recording the truth belongs to
}

}  // namespace
}  // namespace hm
