#include "hm/io/rosbag/bag_writer.hpp"
#include "hm/core/testing/source_folder.hpp"

#include <gmock/gmock.h>

#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/testing/io_test_support.hpp"
#include "hm/io/testing/testing_bags.hpp"

/// Round trip of written bags.
namespace hm {
namespace {

using namespace testing_bags;
using test::read_bytes;
using test::write_bytes;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(BagWriter, EverythingComesBack) {
  const TemporaryFolder folder;
  write_small_bag(folder / "a.bag", 20);
  const LaserRecording recording = opened(folder / "a.bag");
  EXPECT_EQ(recording.kind, LaserRecordingKind::kRosBag);
  expect_small_bag(recording, 20);
  EXPECT_THAT(recording.notes, ElementsAre(HasSubstr("the range sensor is not used")));
  EXPECT_THAT(recording.truth_source, HasSubstr("/mocap"));
  EXPECT_EQ(folder.file_count(), 1U);  // nothing partial is left
}

/// What rosbag's own library says of a bag; nothing where it is not installed.
std::optional<std::string> rosbag_says(const std::filesystem::path& bag) {
  const std::string command =
      fmt::format("/usr/bin/python3 '{}/tests/program/rosbag_tool.py' check '{}' 2>&1",
                  test::source_folder().string(), bag.string());
  std::FILE* pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return std::nullopt;
  std::string output;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) output += static_cast<char>(c);
  const int status = WEXITSTATUS(::pclose(pipe));
  if (status == 77 || status == 127) return std::nullopt;
  EXPECT_EQ(status, 0) << output;
  return output;
}

/// rosbag's own library reads it: types, definitions and digests fit, every message is there with its times.
TEST(BagWriter, RosbagReadsIt) {
  const TemporaryFolder folder;
  write_small_bag(folder / "a.bag", 600);  // two chunks
  const auto output = rosbag_says(folder / "a.bag");
  if (!output) GTEST_SKIP() << "no rosbag here";
  for (const std::string line : {"/scan sensor_msgs/LaserScan right\n", "/imu sensor_msgs/Imu right\n",
                                 "/sonar sensor_msgs/Range right\n", "/odom nav_msgs/Odometry right\n",
                                 "/mocap geometry_msgs/PoseStamped right\n"})
    EXPECT_THAT(*output, HasSubstr(line));
  EXPECT_EQ(std::ranges::count(*output, '\n'), 5 + 5 * 600);
  for (std::size_t i = 0; i < 600; ++i) {
    const std::int64_t stamp_ns = small_scan(i).stamp.ns;
    EXPECT_THAT(*output, HasSubstr(fmt::format("/scan {} {} {} laser\n", i, stamp_ns, stamp_ns + 1'000'000)));
  }
}

TEST(BagWriter, RosbagReadsTransforms) {
  const TemporaryFolder folder;
  write_bag_with_transforms(folder / "a.bag", 3);
  const auto output = rosbag_says(folder / "a.bag");
  if (!output) GTEST_SKIP() << "no rosbag here";
  EXPECT_THAT(*output, HasSubstr("/tf tf2_msgs/TFMessage right\n"));
  EXPECT_THAT(*output, HasSubstr("/tf odom base_link 0.2 -2.0 0.5\n"));
  EXPECT_THAT(*output, HasSubstr("/tf base_link laser 0.25 0.0 0.5\n"));
}

TEST(BagWriter, ManyChunks) {
  const TemporaryFolder folder;
  constexpr std::size_t kBeams = 24, kScans = 9000;  // the beams of a scan span less than a turn
  write_small_bag(folder / "a.bag", kScans, kBeams);
  EXPECT_GT(read_bytes(folder / "a.bag").size(), 5U << 20U);
  expect_small_bag(opened(folder / "a.bag"), kScans, kBeams);
}

TEST(BagWriter, ABagWithoutMessagesIsABag) {
  const TemporaryFolder folder;
  ASSERT_TRUE(BagWriter(folder / "a.bag").finish());
  const auto recording = open_laser_recording(folder / "a.bag");
  ASSERT_FALSE(recording);
  EXPECT_EQ(recording.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(recording.error().message, HasSubstr("sensor_msgs/LaserScan"));
}

TEST(BagWriter, UnfinishedLeavesNothing) {
  const TemporaryFolder folder;
  { BagWriter(folder / "a.bag").write_scan({"/scan", "laser"}, Time{kStart_ns}, small_scan(0)); }
  EXPECT_EQ(folder.file_count(), 0U);
  BagWriter nowhere(folder / "no_such_folder/a.bag");
  nowhere.write_scan({"/scan", "laser"}, Time{kStart_ns}, small_scan(0));
  EXPECT_FALSE(nowhere.finish());
}

TEST(BagWriter, WhatWasFlushedCanBeReadBeforeItIsFinished) {
  const TemporaryFolder folder;
  BagWriter bag(folder / "a.bag");
  const auto write = [&](std::size_t i) {
    bag.write_scan({"/scan", "laser"}, small_scan(i).stamp, small_scan(i));
  };
  write(0), write(1);
  bag.flush();
  write(2);
  const LaserRecording killed = opened(folder / "a.bag.partial");
  ASSERT_EQ(killed.lasers.size(), 1U);
  EXPECT_EQ(killed.lasers[0].scans.size(), 2U);
  bag.flush();
  bag.flush();  // nothing new
  ASSERT_TRUE(bag.finish());
  EXPECT_EQ(opened(folder / "a.bag").lasers[0].scans.size(), 3U);
}

TEST(BagWriter, MarkersForNoReturnAreToldApart) {
  const TemporaryFolder folder;
  LaserScan scan = small_scan(0);
  scan.ranges_m = {1, LaserScan::kNoReturn, LaserScan::kInvalid, 0, -1, 81.83F, 30, 31, 0.05F, 29.99F, 0, 0};
  BagWriter writer(folder / "a.bag");
  writer.write_scan({"/scan", "laser"}, scan.stamp, scan);
  ASSERT_TRUE(writer.finish());
  const LaserRecording recording = opened(folder / "a.bag");
  const LaserStream& laser = recording.lasers.at(0);
  std::string kinds;
  for (std::size_t b = 0; b < scan.size(); ++b) {
    const float range = laser.scans[0].ranges_m[b];
    kinds += laser.scans[0].is_return(b) ? 'r' : std::isnan(range) ? 'i' : std::isinf(range) ? 'n' : '?';
  }
  EXPECT_EQ(kinds, "rnininnnirnn");
  EXPECT_EQ(laser.no_returns, 7U);
  EXPECT_EQ(laser.invalid, 3U);
  ASSERT_FALSE(laser.sentinels_m.empty());
  EXPECT_EQ(laser.sentinels_m[0], (std::pair<float, std::size_t>{0.F, 3}));
  EXPECT_THAT(laser.sentinels_m, Contains(std::pair<float, std::size_t>{81.83F, 1}));
}

}  // namespace
}  // namespace hm
