#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/pose/relations_file.hpp"
#include "hm/io/testing/real_data_test_support.hpp"

/// Readers on real recordings, if available.
namespace hm {
namespace {

std::filesystem::path data(const std::string& name) { return real_data_folder() / name; }

class RealLaserRecording : public ::testing::Test {
 protected:
  /// Opens it into recording_; false, with the test marked as skipped, when it is not there.
  bool open(const std::string& name) {
    if (!std::filesystem::exists(data(name))) {
      skip_reason_ = "no recording at " + data(name).string();
      return false;
    }
    auto opened = open_laser_recording(data(name));
    EXPECT_TRUE(opened) << to_string(opened.error());
    if (opened) recording_ = std::move(*opened);
    return opened.has_value();
  }
  void expect_scans(std::size_t laser, std::size_t scans, std::size_t beams) {
    ASSERT_GT(recording_.lasers.size(), laser);
    EXPECT_EQ(recording_.lasers[laser].scans.size(), scans);
    for (const LaserScan& scan : recording_.lasers[laser].scans) ASSERT_EQ(scan.size(), beams);
  }
  LaserRecording recording_;
  std::string skip_reason_;
};

/// rosbag counts 360 scans: 82 of them lie behind an index record with a wrong size.
TEST_F(RealLaserRecording, AuthorsBag) {
  if (!open("bags/scan_tools_laser_demo.bag")) GTEST_SKIP() << skip_reason_;
  expect_scans(0, 360, 681);
  EXPECT_TRUE(recording_.notes.empty());
  EXPECT_EQ(recording_.lasers[0].scans[0].stamp.ns, 1'282'836'370'970'876'375);
  EXPECT_NEAR(recording_.lasers[0].scans[0].range_max_m, 5.6, 1e-6);
}

TEST_F(RealLaserRecording, ImuBag) {
  if (!open("bags/imu_tools_ardrone_imu.bag")) GTEST_SKIP() << skip_reason_;
  ASSERT_EQ(recording_.imu.size(), 4308U);
  EXPECT_NEAR(recording_.imu[0].specific_force_m_s2.z(), 9.682, 1e-3);
  EXPECT_TRUE(recording_.imu[0].R_world_imu);
}

TEST_F(RealLaserRecording, IntelLab) {
  if (!open("laser/flirt_intel-lab.log")) GTEST_SKIP() << skip_reason_;
  expect_scans(0, 2671, 180);  // 2672, less one that is stamped before the one before it
  EXPECT_TRUE(recording_.odometry.empty());
  EXPECT_EQ(recording_.truth.size(), 2671U);
  EXPECT_NEAR(path_length(recording_.truth), 360, 1);
  EXPECT_GT(recording_.corrected_stamps.size(), 90U);
  ASSERT_EQ(recording_.lasers[0].sentinels_m.size(), 1U);
  EXPECT_EQ(recording_.lasers[0].sentinels_m[0], (std::pair<float, std::size_t>{81.83F, 10677}));
}

TEST_F(RealLaserRecording, IntelRelations) {
  if (!open("laser/flirt_intel-lab.log")) GTEST_SKIP() << skip_reason_;
  auto list = read_relations(data("laser/intel.relations"));
  ASSERT_TRUE(list) << to_string(list.error());
  EXPECT_EQ(list->relations.size(), 2984U);
  correct_relations(list->relations, recording_.corrected_stamps);
  // Those between two stamps of the log agree with its corrected poses.
  std::vector<double> errors_m;
  const auto pose_of = [&](Time stamp) { return pose_at(recording_.truth, stamp, Duration{}, Duration{}); };
  for (const PoseRelation& relation : list->relations) {
    const auto from = pose_of(relation.from), to = pose_of(relation.to);
    if (from && to)
      errors_m.push_back(((from->inverse() * *to).inverse() * relation.T_from_to).translation().norm());
  }
  ASSERT_GT(errors_m.size(), 250U);
  std::ranges::nth_element(errors_m, errors_m.begin() + static_cast<std::ptrdiff_t>(errors_m.size() / 2));
  EXPECT_LT(errors_m[errors_m.size() / 2], 0.05);
}

TEST_F(RealLaserRecording, WeanHall) {
  if (!open("laser/wean_robotdata1.log")) GTEST_SKIP() << skip_reason_;
  expect_scans(0, 713, 180);
  EXPECT_EQ(recording_.odometry.size(), 713U + 1505U);
  EXPECT_NEAR(recording_.lasers[0].T_base_laser.translation().x(), 0.25, 1e-6);
}

TEST_F(RealLaserRecording, NewCollege) {
  if (!open("laser/ncd_QuadTree_Alog.alog")) GTEST_SKIP() << skip_reason_;
  expect_scans(0, 263, 181);
  expect_scans(1, 255, 181);
  EXPECT_EQ(recording_.odometry.size(), 98U);
}

TEST_F(RealLaserRecording, BreezySlam) {
  if (!open("laser/breezyslam_exp1.dat")) GTEST_SKIP() << skip_reason_;
  expect_scans(0, 756, 682);
  EXPECT_EQ(recording_.odometry.size(), 756U);
}

TEST_F(RealLaserRecording, Euroc) {
  if (!open("imu/euroc_V1_02_medium")) GTEST_SKIP() << skip_reason_;
  EXPECT_EQ(recording_.imu.size(), 7999U);
  EXPECT_EQ(recording_.truth.size(), 3340U);
}

}  // namespace
}  // namespace hm
