#include "hm/io/rgbd/carried_imu_file.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/io/testing/testing_recordings.hpp"

namespace hm {
namespace {

using namespace testing_recordings;

TEST(CarriedImuFile, WhatIsWrittenIsReadBackInTheCamerasFrame) {
  const TemporaryFolder folder;
  const Mat3 R_camera_imu = so3_exp(Vec3(0.3, -1.2, 2.5));
  std::vector<ImuSample> samples;
  for (int i = 0; i < 50; ++i)
    samples.push_back(
        {Time{1'000'000'007 + i * 5'000'001LL}, Vec3(0.1 * i, -0.2, 0.3), Vec3(1, 9.8, -0.01 * i), {}});
  ASSERT_TRUE(write_carried_imu(folder.path(), samples, R_camera_imu));
  const auto read = read_carried_imu(folder.path());
  ASSERT_TRUE(read && *read);
  EXPECT_TRUE((*read)->has_gyroscope);
  EXPECT_EQ((*read)->source, "imu.csv");
  ASSERT_EQ((*read)->samples.size(), samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const ImuSample& got = (*read)->samples[i];
    EXPECT_EQ(got.stamp, samples[i].stamp);
    EXPECT_LT((got.angular_velocity_rad_s - R_camera_imu * samples[i].angular_velocity_rad_s).norm(), 1e-7);
    EXPECT_LT((got.specific_force_m_s2 - R_camera_imu * samples[i].specific_force_m_s2).norm(), 1e-7);
  }
}

TEST(CarriedImuFile, AKinectsAccelerometerIsTurnedAndRepeatsAreLeftOut) {
  const TemporaryFolder folder;
  ASSERT_TRUE(
      write_file_text(folder.path() / "accelerometer.txt",
                      "# accelerometer data\n1.0 0.5 7.2 -6.3\n1.1 0.5 7.2 -6.3\n1.2 0.4 7.2 -6.3\n1.3 0"));
  const auto read = read_carried_imu(folder.path());
  ASSERT_TRUE(read && *read);
  EXPECT_FALSE((*read)->has_gyroscope);
  ASSERT_EQ((*read)->samples.size(), 2u);
  EXPECT_EQ((*read)->samples[0].specific_force_m_s2, Vec3(-0.5, -7.2, -6.3));
  EXPECT_EQ((*read)->samples[1].stamp, Time::from_seconds(1.2));
}

TEST(CarriedImuFile, WhatARecordingHoldsIsWrittenAndReadBack) {
  for (const bool has_gyroscope : {true, false}) {
    const TemporaryFolder folder;
    CarriedImu imu{{}, has_gyroscope, ""};
    imu.samples.push_back(
        {Time::from_seconds(1.5), Vec3(0.1, -0.2, 0.3) * has_gyroscope, Vec3(1, -9.7, 0.5), {}});
    imu.samples.push_back(
        {Time::from_seconds(1.6), Vec3(0.2, -0.1, 0.1) * has_gyroscope, Vec3(2, -9.6, 0.7), {}});
    ASSERT_TRUE(write_carried_imu(folder.path(), imu));
    const auto read = read_carried_imu(folder.path());
    ASSERT_TRUE(read && *read);
    EXPECT_EQ((*read)->has_gyroscope, has_gyroscope);
    ASSERT_EQ((*read)->samples.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ((*read)->samples[i].stamp, imu.samples[i].stamp);
      EXPECT_LT(((*read)->samples[i].angular_velocity_rad_s - imu.samples[i].angular_velocity_rad_s).norm(),
                1e-8);
      EXPECT_LT(((*read)->samples[i].specific_force_m_s2 - imu.samples[i].specific_force_m_s2).norm(), 1e-8);
    }
  }
}

TEST(CarriedImuFile, NoneIsNoneAndNonsenseIsAnErrorWithItsLine) {
  const TemporaryFolder folder;
  const auto none = read_carried_imu(folder.path());
  ASSERT_TRUE(none);
  EXPECT_FALSE(*none);
  ASSERT_TRUE(
      write_file_text(folder.path() / "accelerometer.txt", "1.0 0.5 7.2 -6.3\n1.1 up 7 6\n1.2 1 2 3\n"));
  const auto wrong = read_carried_imu(folder.path());
  ASSERT_FALSE(wrong);
  EXPECT_NE(to_string(wrong.error()).find("accelerometer.txt:2"), std::string::npos)
      << to_string(wrong.error());
  ASSERT_TRUE(write_file_text(folder.path() / "imu.csv", "1000000000,0,0,0,0,9.8,0\n"));
  ASSERT_TRUE(write_file_text(folder.path() / "imu.toml", "[imu]\nrpy_deg = [1, 2]\n"));
  const auto mount = read_carried_imu(folder.path());
  ASSERT_FALSE(mount);
  EXPECT_NE(to_string(mount.error()).find("imu.toml:2"), std::string::npos) << to_string(mount.error());
}

/// Rotation of a Kinect's accelerometer, checked with motion capture: the mean specific force points up,
/// except for its bias.
TEST(CarriedImuFile, AKinectsReadingsPointUpInTheWorld) {
  const auto path = real_recording("tum_fr1_xyz");
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  const auto recording = open_recording(path);
  ASSERT_TRUE(recording && (*recording)->info().imu);
  const RecordingInfo& info = (*recording)->info();
  Vec3 sum = Vec3::Zero();
  std::size_t next = 0;
  for (const ImuSample& sample : info.imu->samples) {
    while (next < info.trajectory.size() && info.trajectory[next].stamp < sample.stamp) ++next;
    if (next == info.trajectory.size()) break;
    sum += info.trajectory[next].T_world_base.rotation() * sample.specific_force_m_s2;
  }
  EXPECT_GT(sum.normalized().z(), std::cos(0.1));
}

/// IMU data is optional: a recording opens without it, with a note.
TEST(CarriedImuFile, ARecordingHasThemOrSaysWhyNot) {
  const TemporaryFolder folder;
  write_small_tum(folder.path() / "r", 2);
  auto recording = open_recording(folder.path() / "r");
  ASSERT_TRUE(recording);
  EXPECT_FALSE((*recording)->info().imu);
  ASSERT_TRUE(write_file_text(folder.path() / "r" / "accelerometer.txt", "1.0 0.5 7.2 -6.3\n"));
  recording = open_recording(folder.path() / "r");
  ASSERT_TRUE(recording && (*recording)->info().imu);
  ASSERT_TRUE(write_file_text(folder.path() / "r" / "accelerometer.txt", "1.0 0.5\n2 3 4 5\n"));
  recording = open_recording(folder.path() / "r");
  ASSERT_TRUE(recording);
  EXPECT_FALSE((*recording)->info().imu);
  EXPECT_NE((*recording)->info().notes.find("inertial readings are not used"), std::string::npos);
}

}  // namespace
}  // namespace hm
