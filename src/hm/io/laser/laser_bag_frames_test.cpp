#include "hm/io/laser/laser_bag_frames.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <numbers>

#include "hm/io/testing/io_test_support.hpp"
#include "hm/io/testing/testing_bags.hpp"

/// Mounts of lasers and odometry from the transforms of a bag.
namespace hm {
namespace {

using namespace testing_bags;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kPi = std::numbers::pi;

SE3 pose(const Vec3& rpy_rad, const Vec3& xyz_m) { return {rotation_from_roll_pitch_yaw(rpy_rad), xyz_m}; }
const SE3 kUpsideDown = pose({kPi, 0, 0}, {0.25, 0, 0.2});
const SE3 kRaised = pose({0, 0, 0}, {0.05, 0, 0.1});

/// The vehicle at the time of small_pose(i), level.
SE3 driven(std::size_t i) {
  const auto t = static_cast<double>(i);
  return pose({0, 0, 0.1 * t}, {0.1 * t, 0.02 * t * t, 0});
}

/// A bag of five scans in the frame `laser`, and what a test adds.
class BagFramesTest : public ::testing::Test {
 protected:
  static constexpr std::size_t kScans = 5;

  explicit BagFramesTest(const std::string& laser_frame = "/laser") : writer_(folder_ / "a.bag") {
    for (std::size_t i = 0; i < kScans; ++i)
      writer_.write_scan({"/scan", laser_frame}, small_scan(i).stamp, small_scan(i));
  }
  static Time at(std::size_t i) { return small_pose(i).stamp; }
  void send(const std::string& topic, std::size_t i, const std::string& parent, const std::string& child,
            const SE3& T_parent_child) {
    const FrameTransform transform{at(i), parent, child, T_parent_child};
    writer_.write_transforms(topic, at(i), {&transform, 1});
  }
  void fixed(const std::string& parent, const std::string& child, const SE3& T_parent_child) {
    send("/tf_static", 0, parent, child, T_parent_child);
  }
  void drive(const std::string& parent, const std::string& child) {
    for (std::size_t i = 0; i < kScans; ++i) send("/tf", i, parent, child, driven(i));
  }
  /// Odometry messages of another path.
  void drive_topic(const std::string& child) {
    for (std::size_t i = 0; i < kScans; ++i)
      writer_.write_odometry({"/odom", "odom", child}, at(i), {small_pose(i), {}, {}});
  }
  LaserRecording recording() {
    EXPECT_TRUE(writer_.finish());
    return opened(folder_ / "a.bag");
  }

  TemporaryFolder folder_;
  BagWriter writer_;
};

TEST_F(BagFramesTest, AChainGivesMountAndOdometry) {
  drive("odom", "base_footprint");
  for (std::size_t i = 0; i < kScans; ++i) {
    send("/tf", i, "/map", "/odom", driven(2 * i));  // of a localisation: neither truth nor odometry
    send("/tf", i, "/base_footprint", "/base_link", kRaised);
    send("/tf", i, "base_link", "laser", kUpsideDown);
  }
  const LaserRecording made = recording();
  const LaserStream& laser = made.lasers.at(0);
  EXPECT_LT(difference(laser.T_base_laser, kRaised * kUpsideDown), 1e-12);
  EXPECT_EQ(laser.frame_id, "/laser");
  EXPECT_EQ(laser.mount_source, "transforms base_footprint -> laser");
  EXPECT_EQ(laser.mount_problem, "");
  ASSERT_EQ(made.odometry.size(), kScans);
  for (std::size_t i = 0; i < kScans; ++i) {
    EXPECT_EQ(made.odometry[i].stamp, at(i));
    EXPECT_LT(difference(made.odometry[i].T_world_base, driven(i)), 1e-12);
  }
  EXPECT_EQ(made.odometry_source, "/tf (odom -> base_footprint)");
  EXPECT_TRUE(made.truth.empty());
  EXPECT_THAT(made.notes, IsEmpty());
}

TEST_F(BagFramesTest, ARangeSensorIsMountedByTheSameTransforms) {
  const SE3 down = pose({0, kPi / 2, 0}, {0.1, 0, 0.05});
  writer_.write_range({"/sonar", "/sonar"}, at(0), {at(0), 1.5, 0.25, 4});
  drive("odom", "base_footprint");
  fixed("base_footprint", "base_link", kRaised);
  fixed("base_link", "sonar", down);
  const LaserRecording made = recording();
  ASSERT_TRUE(made.range.T_base_range);
  EXPECT_LT(difference(*made.range.T_base_range, kRaised * down), 1e-12);
  EXPECT_THAT(made.notes,
              Contains("/sonar: mount of the range sensor from transforms base_footprint -> sonar"));
}

TEST_F(BagFramesTest, ARangeSensorThatNothingMountsIsSaid) {
  writer_.write_range({"/sonar", "sonar"}, at(0), {at(0), 1.5, 0.25, 4});
  drive("odom", "base_footprint");
  const LaserRecording made = recording();
  EXPECT_FALSE(made.range.T_base_range);
  EXPECT_THAT(made.notes,
              Contains(HasSubstr("no transform joins its frame sonar to the base base_footprint: the "
                                 "range sensor is not used")));
}

TEST_F(BagFramesTest, OdometryMessagesComeFirstAndNameTheBase) {
  drive("odom", "base_footprint");
  drive_topic("base_link");
  fixed("base_footprint", "base_link", kRaised);
  fixed("base_footprint", "laser", kUpsideDown);
  const LaserRecording made = recording();
  EXPECT_LT(difference(made.lasers.at(0).T_base_laser, kRaised.inverse() * kUpsideDown), 1e-12);
  ASSERT_EQ(made.odometry.size(), kScans);
  EXPECT_LT(difference(made.odometry[3].T_world_base, small_pose(3).T_world_base), 1e-12);
  EXPECT_THAT(made.odometry_source, HasSubstr("nav_msgs/Odometry"));
}

/// Transforms and messages of one path are one odometry, bit by bit.
TEST(BagFramesOdometry, EqualsThatOfTheTopic) {
  const TemporaryFolder folder;
  for (const std::string name : {"topic.bag", "tf.bag"}) {
    BagWriter writer(folder / name);
    for (std::size_t i = 0; i < 50; ++i) {
      const StampedPose pose = small_pose(i);
      const FrameTransform transform{pose.stamp, "odom", "base", pose.T_world_base};
      writer.write_scan({"/scan", "base"}, pose.stamp, small_scan(i));
      if (name == "tf.bag")
        writer.write_transforms("/tf", pose.stamp, {&transform, 1});
      else
        writer.write_odometry({"/odom", "odom", "base"}, pose.stamp, {pose, {}, {}});
    }
    ASSERT_TRUE(writer.finish());
  }
  const LaserRecording topic = opened(folder / "topic.bag"), tf = opened(folder / "tf.bag");
  ASSERT_EQ(topic.odometry.size(), 50U);
  ASSERT_EQ(tf.odometry.size(), 50U);
  for (std::size_t i = 0; i < 50; ++i) {
    EXPECT_EQ(tf.odometry[i].stamp, topic.odometry[i].stamp);
    EXPECT_EQ(tf.odometry[i].T_world_base.matrix(), topic.odometry[i].T_world_base.matrix());
  }
}

TEST_F(BagFramesTest, AMovingBaseNeedsNoKnownName) {
  drive("robot_0/odom_combined", "robot_0/chassis");
  send("/tf", 0, "robot_0/odom_combined", "robot_0/dock", SE3());
  fixed("robot_0/chassis", "laser", kUpsideDown);
  const LaserRecording made = recording();
  EXPECT_LT(difference(made.lasers.at(0).T_base_laser, kUpsideDown), 1e-12);
  EXPECT_THAT(made.odometry_source, HasSubstr("robot_0/chassis"));
}

TEST_F(BagFramesTest, OdometryThatNeverMovesIsNone) {
  for (std::size_t i = 0; i < kScans; ++i) send("/tf", i, "odom", "base_link", SE3());
  fixed("base_link", "laser", kUpsideDown);
  const LaserRecording made = recording();
  EXPECT_TRUE(made.odometry.empty());
  EXPECT_THAT(made.notes, ElementsAre(HasSubstr("odom -> base_link never changes")));
  EXPECT_LT(difference(made.lasers.at(0).T_base_laser, kUpsideDown), 1e-12);
}

TEST_F(BagFramesTest, ALaserThatTiltsHasNoMount) {
  drive("odom", "base_link");
  for (std::size_t i = 0; i < kScans; ++i)
    send("/tf", i, "base_link", "laser", pose({0, 0.1 * static_cast<double>(i), 0}, {0.1, 0, 0}));
  const LaserRecording made = recording();
  EXPECT_LT(difference(made.lasers.at(0).T_base_laser, SE3()), 1e-12);
  EXPECT_EQ(made.lasers.at(0).mount_source, "");
  EXPECT_THAT(made.lasers.at(0).mount_problem,
              HasSubstr("base_link -> laser changes by up to 0 m and 22.9 deg"));
  EXPECT_EQ(made.odometry.size(), kScans);
}

TEST_F(BagFramesTest, SmallChangesOfAMountAreNone) {
  for (std::size_t i = 0; i < kScans; ++i)
    send("/tf", i, "base_link", "laser", pose({0, 0.0002 * static_cast<double>(i), 0}, {0.1, 0.0002, 0}));
  EXPECT_NEAR(recording().lasers.at(0).T_base_laser.translation().x(), 0.1, 1e-12);
}

TEST_F(BagFramesTest, ALaserThatNothingJoinsIsSaid) {
  drive("odom", "base_link");
  fixed("camera_mount", "laser", kUpsideDown);
  const LaserRecording made = recording();
  EXPECT_THAT(made.lasers.at(0).mount_problem,
              HasSubstr("no transform joins its frame laser to the base base_link"));
  EXPECT_LT(difference(made.lasers.at(0).T_base_laser, SE3()), 1e-12);
}

TEST_F(BagFramesTest, WithoutABaseThereIsNoMount) {
  fixed("tripod", "laser", kUpsideDown);
  EXPECT_THAT(recording().lasers.at(0).mount_problem, HasSubstr("no transform names a base"));
}

TEST_F(BagFramesTest, ARigFileComesFirst) {
  drive("odom", "base_link");
  test::write_bytes(folder_ / "rig.toml", "[laser]\nxyz_m = [1.0, 0.0, 0.0]\n");
  const LaserRecording made = recording();
  EXPECT_EQ(made.lasers.at(0).T_base_laser.translation(), Vec3(1, 0, 0));
  EXPECT_EQ(made.lasers.at(0).mount_source, "rig.toml");
  EXPECT_EQ(made.lasers.at(0).mount_problem, "");
}

TEST_F(BagFramesTest, RepeatedTransformsAreTakenOnceAndBackwardsOnesCounted) {
  drive("odom", "base_link");
  drive("odom", "base_link");
  send("/tf", 9, "odom", "base_link", driven(9));
  send("/tf", 8, "odom", "base_link", driven(8));
  fixed("base_link", "laser", kUpsideDown);
  const LaserRecording made = recording();
  EXPECT_EQ(made.odometry.size(), kScans + 1);
  ASSERT_EQ(made.skipped.size(), 1U);
  EXPECT_EQ(made.skipped[0].reason, SkippedLines::Reason::kStampNotIncreasing);
  EXPECT_EQ(made.skipped[0].count, 1U);
}

TEST_F(BagFramesTest, DamagedTransformsAreCounted) {
  drive("odom", "base_link");
  fixed("base_link", "laser", kUpsideDown);
  fixed("laser", "laser", SE3());                                                   // malformed
  fixed("", "laser", SE3());                                                        // malformed
  fixed("base_link", std::string(1000, 'x'), SE3());                                // malformed
  fixed("base_link", "laser", {Mat3::Identity(), Vec3(NAN, 0, 0)});                 // not finite
  fixed("base_link", "laser", {Mat3::Identity(), Vec3(1e300, 0, 0)});               // not finite
  fixed("base_link", "wheel", {Eigen::Quaterniond(1, 0, 0, 0), {0, 0, HUGE_VAL}});  // not finite
  const LaserRecording made = recording();
  EXPECT_LT(difference(made.lasers.at(0).T_base_laser, kUpsideDown), 1e-12);
  std::size_t malformed = 0, not_finite = 0;
  for (const SkippedLines& skipped : made.skipped) {
    EXPECT_EQ(skipped.file, "/tf_static");
    (skipped.reason == SkippedLines::Reason::kMalformed ? malformed : not_finite) += skipped.count;
  }
  EXPECT_EQ(malformed, 3U);
  EXPECT_EQ(not_finite, 3U);
}

std::string parsed_bytes(const FrameTransform& transform) {
  const TemporaryFolder folder;
  BagWriter writer(folder / "a.bag");
  writer.write_transforms("/tf", transform.stamp, {&transform, 1});
  EXPECT_TRUE(writer.finish());
  std::string bytes;
  EXPECT_TRUE(detail::read_bag(folder / "a.bag", [&](const detail::BagMessage& message) {
    bytes.assign(message.data.begin(), message.data.end());
  }));
  return bytes;
}

detail::MessageBytes as_message(const std::string& bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

TEST(ParseTransforms, EveryPrefixAndImpossibleCountIsRefused) {
  const std::string bytes = parsed_bytes({Time{kStart_ns}, "odom", "base", kUpsideDown});
  ASSERT_TRUE(detail::parse_transforms(as_message(bytes)));
  for (std::size_t length = 0; length < bytes.size(); ++length)
    EXPECT_FALSE(detail::parse_transforms(as_message(bytes.substr(0, length)))) << length;
  EXPECT_FALSE(detail::parse_transforms(as_message(bytes + "x")));
  std::string many = bytes;
  many.replace(0, 4, "\xff\xff\xff\xff");
  EXPECT_FALSE(detail::parse_transforms(as_message(many)));
  EXPECT_TRUE(detail::parse_transforms(as_message(std::string(4, '\0')))->empty());
}

/// A quaternion of zero, or of another length than one, is no rotation; a nearly right one is normalised.
TEST(ParseTransforms, QuaternionsAreNormalisedOrRefused) {
  const std::string bytes = parsed_bytes({Time{kStart_ns}, "base_link", "laser", SE3()});
  const std::vector<std::pair<double, bool>> cases{{0, false}, {3, false}, {NAN, false}, {1.01, true}};
  for (const auto& [w, taken] : cases) {
    std::string changed = bytes;
    std::memcpy(changed.data() + changed.size() - sizeof w, &w, sizeof w);
    detail::BagFrames frames;
    frames.add(
        {{0, "/tf", "tf/tfMessage", "94810edda583a504dfda3829e70d7eec"}, Time{1}, as_message(changed)});
    LaserRecording recording;
    recording.lasers.push_back({.name = "/scan", .frame_id = "laser"});
    frames.apply({}, recording);
    EXPECT_EQ(!recording.lasers[0].mount_source.empty(), taken) << w;
    EXPECT_EQ(recording.skipped.size(), taken ? 0U : 1U) << w;
    EXPECT_TRUE(is_rigid(recording.lasers[0].T_base_laser));
  }
}

TEST(ParseTransforms, AnotherVersionIsSaid) {
  detail::BagFrames frames;
  frames.add({{0, "/tf", "tf/tfMessage", "0123"}, Time{1}, {}});
  LaserRecording recording;
  frames.apply({}, recording);
  EXPECT_THAT(recording.notes, Contains(HasSubstr("/tf has another version")));
}

}  // namespace
}  // namespace hm
