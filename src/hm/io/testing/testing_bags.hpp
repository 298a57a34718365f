#pragma once
#include <bzlib.h>
#include <gtest/gtest.h>
#include <lz4frame.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <string>

#include "hm/core/rng.hpp"
#include "hm/geometry/se2.hpp"
#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/rosbag/bag_writer.hpp"

/// Small bags for tests of the reader, and functions that modify them record by record.
namespace hm::testing_bags {

inline constexpr std::int64_t kStart_ns = 1'282'836'370'970'876'375;  // needs every nanosecond

inline LaserScan small_scan(std::size_t i, std::size_t beams = 12) {
  Rng rng(i + 1);
  LaserScan scan;
  scan.stamp = Time{kStart_ns + static_cast<std::int64_t>(i) * 25'000'003};
  scan.angle_min_rad = -1.5;
  scan.angle_increment_rad = 0.25;
  scan.time_increment_s = 1.0 / 4096;
  scan.range_min_m = 0.0625;
  scan.range_max_m = 30;
  for (std::size_t b = 0; b < beams; ++b) scan.ranges_m.push_back(static_cast<float>(rng.uniform(0.1, 29)));
  return scan;
}

inline ImuSample small_imu(std::size_t i) {
  Rng rng(i + 77);
  ImuSample sample;
  sample.stamp = Time{kStart_ns + static_cast<std::int64_t>(i) * 10'000'001};
  for (int axis = 0; axis < 3; ++axis) {
    sample.angular_velocity_rad_s[axis] = rng.uniform(-1, 1);
    sample.specific_force_m_s2[axis] = rng.uniform(-10, 10);
  }
  if (i % 2 == 0)
    sample.R_world_imu = rotation_from_roll_pitch_yaw({0.1, -0.2, 0.01 * static_cast<double>(i)});
  return sample;
}

inline StampedPose small_pose(std::size_t i) {
  const auto t = static_cast<double>(i);
  return {Time{kStart_ns + static_cast<std::int64_t>(i) * 50'000'000},
          SE3(rotation_from_roll_pitch_yaw({0.01 * t, 0.02, 0.1 * t}), Vec3(0.1 * t, -t, 0.5))};
}

/// Writes `count` messages of every type; each is received a millisecond after its stamp.
inline void write_small_bag(const std::filesystem::path& path, std::size_t count, std::size_t beams = 12) {
  constexpr Duration kDelay{1'000'000};
  BagWriter writer(path);
  for (std::size_t i = 0; i < count; ++i) {
    const LaserScan scan = small_scan(i, beams);
    writer.write_scan({"/scan", "laser"}, scan.stamp + kDelay, scan);
    const ImuSample imu = small_imu(i);
    writer.write_imu({"/imu", "imu"}, imu.stamp + kDelay, imu);
    const StampedPose pose = small_pose(i);
    writer.write_odometry({"/odom", "odom", "base"}, pose.stamp + kDelay, {pose, {1, 2, 3}, {4, 5, 6}});
    writer.write_pose({"/mocap", "world"}, pose.stamp + kDelay, pose);
    writer.write_range({"/sonar", "sonar"}, pose.stamp + kDelay,
                       {pose.stamp, 1 + static_cast<double>(i), 0.25, 4});
  }
  const auto finished = writer.finish();
  ASSERT_TRUE(finished) << to_string(finished.error());
}

/// Writes `count` scans and, as transforms, odometry and the mount of the laser.
inline void write_bag_with_transforms(const std::filesystem::path& path, std::size_t count) {
  BagWriter writer(path);
  for (std::size_t i = 0; i < count; ++i) {
    const StampedPose pose = small_pose(i);
    const FrameTransform transforms[]{
        {pose.stamp, "odom", "base_link", pose.T_world_base},
        {pose.stamp, "base_link", "laser", SE3(Mat3::Identity(), Vec3(0.25, 0, 0.5))}};
    writer.write_scan({"/scan", "laser"}, pose.stamp, small_scan(i));
    writer.write_transforms("/tf", pose.stamp, transforms);
  }
  const auto finished = writer.finish();
  ASSERT_TRUE(finished) << to_string(finished.error());
}

inline double difference(const SE3& a, const SE3& b) {
  return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff();
}

inline LaserRecording opened(const std::filesystem::path& path, const LaserRecordingOptions& options = {}) {
  auto recording = open_laser_recording(path, options);
  EXPECT_TRUE(recording) << to_string(recording.error());
  return recording ? *recording : LaserRecording{};
}

inline void expect_same_scan(const LaserScan& scan, const LaserScan& expected) {
  EXPECT_EQ(scan.stamp, expected.stamp);
  EXPECT_EQ(scan.ranges_m, expected.ranges_m);
  EXPECT_FLOAT_EQ(static_cast<float>(scan.angle_min_rad), static_cast<float>(expected.angle_min_rad));
  EXPECT_NEAR(scan.angle_increment_rad, expected.angle_increment_rad, 1e-7);
  EXPECT_FLOAT_EQ(static_cast<float>(scan.time_increment_s), static_cast<float>(expected.time_increment_s));
  EXPECT_EQ(scan.range_min_m, expected.range_min_m);
  EXPECT_EQ(scan.range_max_m, expected.range_max_m);
}

inline void expect_small_bag(const LaserRecording& recording, std::size_t count, std::size_t beams = 12) {
  ASSERT_EQ(recording.lasers.size(), 1U);
  const LaserStream& laser = recording.lasers[0];
  EXPECT_EQ(laser.name, "/scan");
  ASSERT_EQ(laser.scans.size(), count);
  ASSERT_EQ(laser.received.size(), count);
  ASSERT_EQ(recording.imu.size(), count);
  ASSERT_EQ(recording.odometry.size(), count);
  ASSERT_EQ(recording.truth.size(), count);
  ASSERT_EQ(recording.range.readings.size(), count);
  for (std::size_t i = 0; i < count; ++i) {
    expect_same_scan(laser.scans[i], small_scan(i, beams));
    EXPECT_EQ((laser.received[i] - laser.scans[i].stamp).ns, 1'000'000);
    const ImuSample imu = small_imu(i);
    EXPECT_EQ(recording.imu[i].stamp, imu.stamp);
    EXPECT_EQ(recording.imu[i].angular_velocity_rad_s, imu.angular_velocity_rad_s);
    EXPECT_EQ(recording.imu[i].specific_force_m_s2, imu.specific_force_m_s2);
    ASSERT_EQ(recording.imu[i].R_world_imu.has_value(), i % 2 == 0);
    if (imu.R_world_imu) {
      EXPECT_LT((*recording.imu[i].R_world_imu - *imu.R_world_imu).cwiseAbs().maxCoeff(), 1e-12);
    }
    EXPECT_EQ(recording.odometry[i].stamp, small_pose(i).stamp);
    EXPECT_LT(difference(recording.odometry[i].T_world_base, small_pose(i).T_world_base), 1e-12);
    EXPECT_LT(difference(recording.truth[i].T_world_base, small_pose(i).T_world_base), 1e-12);
    const double range_m = 1 + static_cast<double>(i);
    EXPECT_EQ(recording.range.readings[i].range_m, range_m < 4 ? range_m : HUGE_VAL);
  }
}

/// Raw record of a bag file.
struct RawRecord {
  std::string header, data;
  [[nodiscard]] bool is(char op) const {
    return header.find(std::string("\4\0\0\0op=", 7) + op) != std::string::npos;
  }
};

inline std::uint32_t number_at(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

inline std::string as_bytes(std::uint32_t value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

/// Returns the bag with each top-level record replaced by the result of `change`.
inline std::string with_records(const std::string& bag, const std::function<std::string(RawRecord)>& change) {
  constexpr std::size_t kMagicBytes = 13;
  std::string result = bag.substr(0, kMagicBytes);
  for (std::size_t at = kMagicBytes; at < bag.size();) {
    RawRecord record;
    record.header = bag.substr(at + 4, number_at(bag, at));
    at += 4 + record.header.size();
    record.data = bag.substr(at + 4, number_at(bag, at));
    at += 4 + record.data.size();
    result += change(record);
  }
  return result;
}

inline std::string record_bytes(const RawRecord& record) {
  return as_bytes(static_cast<std::uint32_t>(record.header.size())) + record.header +
         as_bytes(static_cast<std::uint32_t>(record.data.size())) + record.data;
}

inline std::string compressed(const std::string& data, const std::string& how) {
  std::string out(data.size() * 2 + 1024, '\0');
  if (how == "bz2") {
    auto size = static_cast<unsigned>(out.size());
    std::string input = data;
    EXPECT_EQ(BZ2_bzBuffToBuffCompress(out.data(), &size, input.data(), static_cast<unsigned>(input.size()),
                                       9, 0, 0),
              BZ_OK);
    out.resize(size);
  } else {
    const std::size_t size = LZ4F_compressFrame(out.data(), out.size(), data.data(), data.size(), nullptr);
    EXPECT_FALSE(LZ4F_isError(size));
    out.resize(size);
  }
  return out;
}

/// Returns the bag with its index position corrected.
inline std::string with_index_position(const std::string& bag) {
  std::size_t position = 13, index_position = 0;
  with_records(bag, [&](const RawRecord& record) {
    if (record.is('\7') && index_position == 0) index_position = position;
    position += record_bytes(record).size();
    return std::string();
  });
  return with_records(bag, [&](RawRecord record) {
    if (record.is('\3')) {
      const std::string bytes = as_bytes(static_cast<std::uint32_t>(index_position)) + std::string(4, '\0');
      record.header.replace(record.header.find("index_pos=") + 10, 8, bytes);
    }
    return record_bytes(record);
  });
}

/// Returns the bag with its chunks compressed.
inline std::string with_compression(const std::string& bag, const std::string& how) {
  return with_index_position(with_records(bag, [&](RawRecord record) {
    if (!record.is('\5')) return record_bytes(record);
    record.data = compressed(record.data, how);
    const std::string old = as_bytes(16) + "compression=none", now = as_bytes(15) + "compression=" + how;
    record.header.replace(record.header.find(old), old.size(), now);
    return record_bytes(record);
  }));
}

}  // namespace hm::testing_bags
