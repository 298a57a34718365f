#include <gmock/gmock.h>

#include <functional>

#include "hm/io/testing/io_test_support.hpp"
#include "hm/io/testing/testing_bags.hpp"

/// Every prefix and many random corruptions of a small file of each kind: an Error, or a recording that
/// satisfies its invariants; never a crash (run under ASan and UBSan).
namespace hm {
namespace {

template <class Items, class StampOf>
void expect_increasing(const Items& items, StampOf stamp_of) {
  for (std::size_t i = 1; i < items.size(); ++i) ASSERT_LT(stamp_of(items[i - 1]), stamp_of(items[i]));
}

void expect_sound_scan(const LaserScan& scan) {
  ASSERT_GT(scan.size(), 0U);
  ASSERT_TRUE(std::isfinite(scan.angle_min_rad) && std::isfinite(scan.angle_increment_rad));
  ASSERT_NE(scan.angle_increment_rad, 0);
  ASSERT_TRUE(std::isfinite(scan.time_increment_s));
  for (const float range : scan.ranges_m)
    ASSERT_TRUE(std::isnan(range) || range == LaserScan::kNoReturn ||
                (range > 0 && static_cast<double>(range) < scan.range_max_m));
}

void expect_sound(const LaserRecording& recording) {
  for (const LaserStream& laser : recording.lasers) {
    ASSERT_FALSE(laser.scans.empty());
    ASSERT_TRUE(laser.received.empty() || laser.received.size() == laser.scans.size());
    ASSERT_TRUE(is_rigid(laser.T_base_laser));
    expect_increasing(laser.scans, [](const LaserScan& scan) { return scan.stamp; });
    for (const LaserScan& scan : laser.scans) expect_sound_scan(scan);
  }
  expect_increasing(recording.imu, [](const ImuSample& sample) { return sample.stamp; });
  expect_increasing(recording.range.readings, [](const RangeReading& reading) { return reading.stamp; });
  for (const Trajectory& poses : {recording.odometry, recording.truth}) {
    expect_increasing(poses, [](const StampedPose& pose) { return pose.stamp; });
    for (const StampedPose& pose : poses) ASSERT_TRUE(is_rigid(pose.T_world_base));
  }
  for (const ImuSample& sample : recording.imu) ASSERT_TRUE(sample.specific_force_m_s2.allFinite());
}

/// Opens `damaged` versions of `bytes` as `name`; the share of them that still gave a recording.
double open_damaged(const std::string& name, const std::string& bytes, int changes) {
  const TemporaryFolder folder;
  const auto path = folder / name;
  int opened = 0;
  const int cases = test::for_each_damaged(bytes, changes, [&](const std::string& damaged) {
    if (::testing::Test::HasFatalFailure()) return;
    test::write_bytes(path, damaged);
    const auto recording = open_laser_recording(path);
    if (recording) {
      ++opened;
      expect_sound(*recording);
    } else {
      EXPECT_FALSE(recording.error().where.empty());
      EXPECT_FALSE(recording.error().message.empty());
    }
  });
  return static_cast<double>(opened) / cases;
}

std::string small_bag(const std::string& compression) {
  const TemporaryFolder folder;
  testing_bags::write_small_bag(folder / "a.bag", 5);
  const std::string plain = test::read_bytes(folder / "a.bag");
  return compression == "none" ? plain : testing_bags::with_compression(plain, compression);
}

class BagFuzz : public ::testing::TestWithParam<const char*> {};

TEST_P(BagFuzz, ErrorOrRecording) { EXPECT_GT(open_damaged("a.bag", small_bag(GetParam()), 1500), 0.04); }
INSTANTIATE_TEST_SUITE_P(Compressions, BagFuzz, ::testing::Values("none", "bz2", "lz4"));

/// Damage that is sure to hit the records: in the chunk of a bag, and its index, without the padding.
void open_damaged_records(const std::string& bag) {
  const std::size_t padding = bag.find("    "), chunk = bag.find("compression=none") - 12;
  ASSERT_LT(padding, chunk);
  const std::string head = bag.substr(0, chunk), tail = bag.substr(chunk);
  const TemporaryFolder folder;
  test::for_each_damaged(tail, 1500, [&](const std::string& damaged) {
    if (::testing::Test::HasFatalFailure()) return;
    test::write_bytes(folder / "a.bag", head + damaged);
    if (const auto recording = open_laser_recording(folder / "a.bag")) expect_sound(*recording);
  });
}

TEST(LaserFuzz, BagWithoutPadding) { open_damaged_records(small_bag("none")); }

TEST(LaserFuzz, BagWithTransforms) {
  const TemporaryFolder folder;
  testing_bags::write_bag_with_transforms(folder / "a.bag", 5);
  open_damaged_records(test::read_bytes(folder / "a.bag"));
}

std::string numbers(int count) {
  std::string text;
  for (int i = 0; i < count; ++i) text += fmt::format("{} ", 1.5 + 0.01 * i);
  return text;
}

TEST(LaserFuzz, Carmen) {
  std::string text = "# CARMEN Logfile\nPARAM front_laser_max 50 1 h 2\n";
  for (int i = 0; i < 4; ++i)
    text += fmt::format(
        "FLASER 6 {0}{1} 0 0 {1} 0 0 {1}.800980 h 1\nODOM {1} 0 0 0 0 0 {1}.5 h 1\n"
        "ROBOTLASER1 0 -1.5 3 0.5 25 0.01 0 6 {0}1 3 {1} 0 0 {1} 0 0 0 0 0 0 0 {1}.{2} h 1\n"
        "RAWLASER2 0 -1.5 3 0.5 25 0.01 0 6 {0}0 {1}.25 h 1\nTRUEPOS 1 2 3 1 2 3 {1}.5 h 1\n",
        numbers(6), i + 100, 900000 / (i + 1));
  EXPECT_GT(open_damaged("a.log", text, 1500), 0.4);
}

TEST(LaserFuzz, Graph) {
  std::string text;
  for (int i = 0; i < 6; ++i)
    text += fmt::format(
        "VERTEX2 {1} 1 2 3\nROBOTLASER1 0 -1.5 3 0.5 25 0.01 0 6 {0}0 {1} 0 0 {1} 0 0 0 0 0 0 0 {1}.{2} h 1\n"
        "EDGE2 0 1 1 2 3 4 5 6 7 8 9\n",
        numbers(6), i + 100, 900000 / (i + 1));
  EXPECT_GT(open_damaged("a.log", text, 1500), 0.2);
}

TEST(LaserFuzz, WeanHall) {
  std::string text;
  for (int i = 0; i < 5; ++i) text += fmt::format("L 1 2 3 2 2 3 {}{}.5\nO 4 5 6 {}.75\n", numbers(5), i, i);
  EXPECT_GT(open_damaged("a.log", text, 1500), 0.2);
}

TEST(LaserFuzz, Moos) {
  std::string text = "%% LOG FILE: x\n";
  for (int i = 0; i < 5; ++i)
    text += fmt::format(
        "1.5 LMS_LASER_2D_LEFT LMS1 "
        "ID=1,time={0}.5,angRes=0.50,minAngle=45.0,Range=[4]{{1,2,-1,3}},R=[1]{{2}}\n"
        "1.5 ODOMETRY_POSE p Pose=[3x1]{{1,2,3}},time={0}.75,Pitch=0.1,Roll=0.2\n",
        i);
  EXPECT_GT(open_damaged("a.alog", text, 1500), 0.2);
}

TEST(LaserFuzz, BreezySlam) {
  std::string text;
  for (int i = 0; i < 3; ++i) {
    text += fmt::format("{} 0 {} {}", 100000 * (i + 1), 30 * i, 29 * i);
    for (int k = 0; k < 21 + 682; ++k) text += fmt::format(" {}", k);
    text += "\n";
  }
  EXPECT_GT(open_damaged("a.dat", text, 1500), 0.2);
}

TEST(LaserFuzz, Euroc) {
  std::string text = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1]\n";
  for (int i = 0; i < 8; ++i) text += fmt::format("140371552391214{}000,1,2,3,4,5,{}.5\n", i, i);
  EXPECT_GT(open_damaged("imu0.csv", text, 1500), 0.2);

  const TemporaryFolder folder;
  test::write_bytes(folder / "imu0.csv", text);
  const std::string truth =
      "#timestamp\n1403715523912140000,1,2,3,1,0,0,0\n1403715523912150000,1,2,3,0.6,0.8,0,0\n";
  test::for_each_damaged(truth, 1500, [&](const std::string& damaged) {
    if (::testing::Test::HasFatalFailure()) return;
    test::write_bytes(folder / "gt0.csv", damaged);
    const auto recording = open_laser_recording(folder / ".");
    ASSERT_TRUE(recording);  // unreadable truth affects nothing else
    expect_sound(*recording);
  });
}

}  // namespace
}  // namespace hm
