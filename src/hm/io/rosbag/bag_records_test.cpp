#include <gmock/gmock.h>

#include <cmath>

#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/rosbag/bag_records.hpp"
#include "hm/io/testing/io_test_support.hpp"
#include "hm/io/testing/testing_bags.hpp"

/// Reading of bags by other recorders, and of damaged or unfinished bags.
namespace hm {
namespace {

using namespace testing_bags;
using test::read_bytes;
using test::write_bytes;
using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(BagReader, CompressedChunks) {
  const TemporaryFolder folder;
  write_small_bag(folder / "a.bag", 3000);
  const std::string plain = read_bytes(folder / "a.bag");
  for (const std::string how : {"bz2", "lz4"}) {
    const std::string bag = with_compression(plain, how);
    EXPECT_LT(bag.size(), plain.size());
    write_bytes(folder / "b.bag", bag);
    const LaserRecording recording = opened(folder / "b.bag");
    expect_small_bag(recording, 3000);
    EXPECT_THAT(recording.notes, ElementsAre(HasSubstr("the range sensor is not used")));
  }
}

/// A recorder that dies leaves no index, says so in the header, and never writes the size of its last chunk.
std::string abandoned(const std::string& bag, const std::string& how) {
  const std::string changed = how == "none" ? bag : with_compression(bag, how);
  std::size_t chunks = 0, seen = 0;
  with_records(changed, [&](const RawRecord& record) { return chunks += record.is('\5'), std::string(); });
  return with_records(changed, [&](RawRecord record) -> std::string {
    if (record.is('\3')) {
      const std::size_t at = record.header.find("index_pos=") + 10;
      record.header.replace(at, 8, std::string(8, '\0'));
      return record_bytes(record);
    }
    if (!record.is('\5')) return record.is('\4') && seen < chunks ? record_bytes(record) : "";
    if (++seen < chunks) return record_bytes(record);
    const std::string data = record.data;
    record.data.clear();
    return record_bytes(record) + data;
  });
}

TEST(BagReader, ABagThatWasNeverClosed) {
  const TemporaryFolder folder;
  write_small_bag(folder / "a.bag", 3000);
  const std::string whole = read_bytes(folder / "a.bag");
  for (const std::string how : {"none", "bz2", "lz4"}) {
    write_bytes(folder / "b.bag", abandoned(whole, how));
    const LaserRecording recording = opened(folder / "b.bag");
    expect_small_bag(recording, 3000);
    EXPECT_THAT(recording.notes, Contains(HasSubstr("never closed"))) << how;
    EXPECT_THAT(recording.notes, Contains(HasSubstr("15,000 messages in"))) << how;
  }
}

/// A bag whose chunks, `count` of them, give `bytes` zeros each.
std::string bomb(const std::string& how, std::size_t bytes, std::size_t count) {
  const TemporaryFolder folder;
  write_small_bag(folder / "a.bag", 3);
  const std::string zeros = compressed(std::string(bytes, '\0'), how);
  return with_records(with_compression(read_bytes(folder / "a.bag"), how), [&](RawRecord record) {
    if (!record.is('\5')) return record_bytes(record);
    std::string all = record_bytes(record);
    record.data = zeros;
    record.header.replace(record.header.find("size=") + 5, 4, as_bytes(static_cast<std::uint32_t>(bytes)));
    for (std::size_t i = 0; i < count; ++i) all += record_bytes(record);
    return all;
  });
}

TEST(BagReader, BombsAreNotDecompressed) {
  const TemporaryFolder folder;
  // One large chunk is refused by itself, many small ones together; what lies before them is read.
  for (const auto& [bytes, count] : {std::pair<std::size_t, std::size_t>{40 << 20, 1}, {8 << 20, 40}})
    for (const std::string how : {"bz2", "lz4"}) {
      if (how == "lz4" && count > 1) continue;  // grows 250-fold at most: its bombs are as large as that
      write_bytes(folder / "b.bag", bomb(how, bytes, count));
      std::size_t messages = 0;
      const auto summary = detail::read_bag(folder / "b.bag", [&](const detail::BagMessage&) { ++messages; });
      ASSERT_TRUE(summary);
      EXPECT_EQ(messages, 15U);
      EXPECT_THAT(summary->problems, Contains(HasSubstr("allowed"))) << how;
      EXPECT_GE(summary->problems.size(), count > 1 ? 32U : 1U);
    }
}

TEST(BagReader, ACutOffBagIsReadToTheCut) {
  const TemporaryFolder folder;
  write_small_bag(folder / "a.bag", 3000);
  const std::string plain = read_bytes(folder / "a.bag");
  for (const std::string how : {"none", "bz2", "lz4"}) {
    const std::string whole = how == "none" ? plain : with_compression(plain, how);
    std::size_t before = 0;
    for (const double part : {0.3, 0.5, 0.7, 0.9}) {
      write_bytes(folder / "b.bag",
                  whole.substr(0, static_cast<std::size_t>(part * static_cast<double>(whole.size()))));
      const LaserRecording recording = opened(folder / "b.bag");
      const std::size_t scans = recording.lasers.at(0).scans.size();
      EXPECT_GT(scans, before) << how << part;
      ASSERT_FALSE(recording.skipped.empty());
      EXPECT_EQ(recording.skipped[0].count, 1U);
      EXPECT_THAT(to_string(recording.skipped[0]),
                  HasSubstr("1 part of b.bag left out: cut off or damaged ("));
      EXPECT_THAT(recording.notes, Contains(AnyOf(HasSubstr("the file ends inside of the chunk at byte"),
                                                  HasSubstr("the file is cut off"))))
          << how;
      for (std::size_t i = 0; i < scans; ++i) expect_same_scan(recording.lasers[0].scans[i], small_scan(i));
      before = scans;
    }
    if (how == "none") {
      EXPECT_NEAR(static_cast<double>(before), 2700, 60);  // plain chunks lose nothing but what is cut off
    }
  }
}

TEST(BagReader, DamagedChunkCostsNoOther) {
  const TemporaryFolder folder;
  write_small_bag(folder / "a.bag", 3000);
  std::size_t chunk = 0;
  const std::string bag =
      with_records(with_compression(read_bytes(folder / "a.bag"), "lz4"), [&](RawRecord record) {
        if (record.is('\5') && chunk++ == 0) record.data.replace(2000, 500, std::string(500, '\xff'));
        return record_bytes(record);
      });
  write_bytes(folder / "b.bag", bag);
  const LaserRecording recording = opened(folder / "b.bag");
  EXPECT_THAT(recording.notes, Contains(HasSubstr("the chunk at byte 4117 is damaged: its lz4 data")));
  EXPECT_EQ(recording.lasers.at(0).scans.back().stamp, small_scan(2999).stamp);
  EXPECT_LT(recording.lasers[0].scans.size(), 3000U);
}

/// Recorders of 2010 wrote 20 bytes an entry as the index's size, and 12 bytes an entry.
TEST(BagReader, IndexRecordsWithAWrongSize) {
  const TemporaryFolder folder;
  write_small_bag(folder / "a.bag", 3000);
  const std::string bag = with_records(read_bytes(folder / "a.bag"), [](const RawRecord& record) {
    std::string bytes = record_bytes(record);
    if (record.is('\4')) {
      const auto wrong = static_cast<std::uint32_t>(record.data.size() / 12 * 20);
      bytes.replace(4 + record.header.size(), 4, as_bytes(wrong));
    }
    return bytes;
  });
  write_bytes(folder / "b.bag", bag);
  expect_small_bag(opened(folder / "b.bag"), 3000);
}

TEST(BagReader, TopicsAreGuessedOrGiven) {
  const TemporaryFolder folder;
  BagWriter writer(folder / "a.bag");
  for (std::size_t i = 0; i < 10; ++i) {
    const LaserScan scan = small_scan(i);
    writer.write_scan({"/busy", "laser"}, scan.stamp, scan);
    if (i % 2 == 0) writer.write_scan({"/a_lazy", "laser2"}, scan.stamp, scan);
    writer.write_imu({"/imu/data", "imu"}, scan.stamp, small_imu(i));
    if (i < 3) writer.write_imu({"/imu/raw", "imu"}, scan.stamp, small_imu(i));
  }
  ASSERT_TRUE(writer.finish());
  const LaserRecording guessed = opened(folder / "a.bag");
  ASSERT_EQ(guessed.lasers.size(), 2U);
  EXPECT_EQ(guessed.lasers[0].name, "/busy");
  EXPECT_EQ(guessed.lasers[1].scans.size(), 5U);
  EXPECT_EQ(guessed.imu.size(), 10U);
  EXPECT_THAT(guessed.notes, Contains(HasSubstr("/imu/raw (3 messages) is not used")));
  const LaserRecording given = opened(folder / "a.bag", {.kind = {},
                                                         .scan_topic = "/a_lazy",
                                                         .imu_topic = "/imu/raw",
                                                         .odometry_topic = {},
                                                         .pose_topic = {},
                                                         .range_topic = {}});
  ASSERT_EQ(given.lasers.size(), 1U);
  EXPECT_EQ(given.lasers[0].name, "/a_lazy");
  EXPECT_EQ(given.imu.size(), 3U);
  LaserRecordingOptions wrong;
  wrong.scan_topic = "/nope";
  const auto failed = open_laser_recording(folder / "a.bag", wrong);
  ASSERT_FALSE(failed);
  EXPECT_THAT(failed.error().message, HasSubstr("/nope"));
}

TEST(BagReader, UselessMessagesAreCountedAndLeftOut) {
  const TemporaryFolder folder;
  BagWriter writer(folder / "a.bag");
  for (std::size_t i = 0; i < 10; ++i) {
    LaserScan scan = small_scan(i);
    if (i == 3) scan.stamp = small_scan(1).stamp;  // runs backwards
    if (i == 5) scan.angle_min_rad = std::nan("");
    if (i == 6) scan.angle_increment_rad = 3;  // many turns
    if (i == 7) scan.range_max_m = scan.range_min_m = 0;
    if (i == 8) scan.angle_min_rad = -90, scan.angle_increment_rad = 15;
    writer.write_scan({"/scan", "laser"}, small_scan(i).stamp, scan);
    StampedPose pose = small_pose(i);
    if (i == 4) pose.T_world_base = SE3(Mat3::Identity(), Vec3(0, std::nan(""), 0));
    writer.write_odometry({"/odom", "odom", "base"}, pose.stamp, {pose});
    ImuSample imu = small_imu(i);
    if (i == 9) imu.specific_force_m_s2.x() = HUGE_VAL;
    writer.write_imu({"/imu", "imu"}, imu.stamp, imu);
  }
  ASSERT_TRUE(writer.finish());
  const LaserRecording recording = opened(folder / "a.bag");
  EXPECT_EQ(recording.lasers.at(0).scans.size(), 5U);
  EXPECT_EQ(recording.odometry.size(), 9U);
  EXPECT_EQ(recording.imu.size(), 9U);
  EXPECT_THAT(recording.notes, Contains("1 message of /scan left out: stamps that run backwards or repeat "
                                        "(first: /scan:4)"));
  EXPECT_THAT(recording.notes, Contains("1 message of /scan left out: NaN or infinity (first: /scan:6)"));
  EXPECT_THAT(recording.notes, Contains("1 message of /scan left out: the beams span 36 rad, more than a "
                                        "turn: degrees? (first: /scan:7)"));
  EXPECT_THAT(recording.notes, Contains("1 message of /scan left out: range_max is 0 (first: /scan:8)"));
  EXPECT_THAT(recording.notes,
              Contains("1 message of /scan left out: angle_min is -90: degrees? (first: /scan:9)"));
  EXPECT_THAT(recording.notes, Contains("1 message of /odom left out: NaN or infinity (first: /odom:5)"));
  EXPECT_THAT(recording.notes, Contains("1 message of /imu left out: NaN or infinity (first: /imu:10)"));
}

TEST(BagReader, OtherVersionsAreNamed) {
  const TemporaryFolder folder;
  write_small_bag(folder / "a.bag", 3);
  std::string bag = read_bytes(folder / "a.bag");
  for (std::size_t at = 0; (at = bag.find("90c7ef2d", at)) != std::string::npos; ++at) bag[at] = '8';
  write_bytes(folder / "b.bag", bag);
  const LaserRecording recording = opened(folder / "b.bag");
  EXPECT_TRUE(recording.lasers.empty());
  EXPECT_THAT(recording.notes,
              Contains("/scan has another version of sensor_msgs/LaserScan, which cannot be read"));

  write_bytes(folder / "c.bag", "#ROSBAG V1.2\n...");
  const auto old = open_laser_recording(folder / "c.bag");
  ASSERT_FALSE(old);
  EXPECT_EQ(old.error().code, ErrorCode::kUnsupported);
  EXPECT_THAT(old.error().message, HasSubstr("#ROSBAG V1.2"));
}

TEST(BagReader, EncryptedIsRefused) {
  const TemporaryFolder folder;
  write_small_bag(folder / "a.bag", 3);
  const std::string bag = with_records(read_bytes(folder / "a.bag"), [](RawRecord record) {
    const std::string field = "encryptor=rosbag/AesCbcEncryptor";
    if (record.is('\3')) record.header += as_bytes(static_cast<std::uint32_t>(field.size())) + field;
    return record_bytes(record);
  });
  write_bytes(folder / "b.bag", bag);
  const auto recording = open_laser_recording(folder / "b.bag");
  ASSERT_FALSE(recording);
  EXPECT_THAT(recording.error().message, HasSubstr("encrypted"));
}

}  // namespace
}  // namespace hm
