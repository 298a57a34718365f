#include "hm/io/lists/pose_list.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"

namespace hm::detail {
namespace {

class PoseListFile : public ::testing::Test {
 protected:
  Result<PoseList> read(const std::string& text) {
    EXPECT_TRUE(write_file_text(path_, text));
    return read_pose_list(path_);
  }
  std::string line(int number) const { return path_.string() + ":" + std::to_string(number); }
  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.path() / "list.txt";
};

TEST_F(PoseListFile, AMalformedLineNamesItsPlace) {
  for (const auto& [text, number] : std::vector<std::pair<std::string, int>>{
           {"1 0 0 0 0 0 0 1\n2 0 0 0 0 0 1\n", 2}, {"1 0 0 0 0 0 0 1 9\n", 1}, {"1 0 x 0 0 0 0 1\n", 1}}) {
    const auto list = read(text);
    ASSERT_FALSE(list) << text;
    EXPECT_EQ(list.error().where, line(number));
  }
  const auto positions = read("1 0 0 0\n2 0 0 0\n");
  ASSERT_FALSE(positions);
  EXPECT_EQ(positions.error().where, line(1));
  EXPECT_THAT(positions.error().message, ::testing::HasSubstr("positions without orientations"));
}

TEST_F(PoseListFile, ACutOffLastLineIsLeftOut) {
  const auto list = read("1 0 0 0 0 0 0 1\n2 0 0 0 0 0");
  ASSERT_TRUE(list);
  EXPECT_EQ(list->poses.size(), 1U);
  ASSERT_EQ(list->skipped.size(), 1U);
  EXPECT_EQ(list->skipped[0].reason, SkippedLines::Reason::kCutOff);
}

TEST_F(PoseListFile, PosesOfALostDeviceAreNotInvented) {
  const auto list = read(
      "1 0 0 0 0 0 0 1\n1.1 nan nan nan nan nan nan nan\n1.2 2 0 0 0 0 0 1\n"
      "1.3 3 0 0 0 0 0 0\n1.4 4 0 0 0 0 0 1\n1.5 5 0 0 0 0 0 1\n1.9 9 0 0 0 0 0 1\n");
  ASSERT_TRUE(list);
  EXPECT_EQ(list->poses.size(), 5U);
  const auto x_at = [&](double t) {
    const auto pose = pose_between(*list, Time::from_seconds(t), Duration::from_seconds(0.25));
    return pose ? pose->translation().x() : -1.0;
  };
  EXPECT_DOUBLE_EQ(x_at(1.0), 0.0);
  EXPECT_EQ(x_at(1.05), -1.0);  // NaN at 1.1
  EXPECT_EQ(x_at(1.1), -1.0);
  EXPECT_EQ(x_at(1.3), -1.0);  // a quaternion of zeros
  EXPECT_NEAR(x_at(1.45), 4.5, 1e-12);
  EXPECT_EQ(x_at(1.7), -1.0);  // neighbours too far apart
  EXPECT_EQ(x_at(1.905), 9.0);
  EXPECT_EQ(x_at(2.0), -1.0);
  ASSERT_EQ(list->skipped.size(), 2U);
  EXPECT_EQ(list->skipped[0].reason, SkippedLines::Reason::kNotFinite);
  EXPECT_EQ(list->skipped[1].reason, SkippedLines::Reason::kNotRigid);
}

/// The same two poses as different programs write them.
TEST_F(PoseListFile, SeparatorsHeadersUnitsOfStampsAndTheOrderOfQuaternions) {
  const SE3 turned(Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5), Vec3(1, 2, 3));
  for (const char* text : {
           "1305031102.5 1 2 3 -0.5 0.5 0.5 0.5\n1305031103 0 0 0 0 0 0 1\n",
           "1305031102.5,1,2,3,-0.5,0.5,0.5,0.5\n1305031103,0,0,0,0,0,0,1\n",
           "1305031102.5; 1; 2; 3; -0.5; 0.5; 0.5; 0.5;\r\n1305031103; 0; 0; 0; 0; 0; 0; 1;\r\n",
           "timestamp,tx,ty,tz,qx,qy,qz,qw\n1305031102.5,1,2,3,-0.5,0.5,0.5,0.5\n1305031103,0,0,0,0,0,0,1\n",
           "time x y z q_w q_x q_y q_z\n1305031102.5 1 2 3 0.5 -0.5 0.5 0.5\n1305031103 0 0 0 1 0 0 0\n",
           "# timestamp tx ty tz qw qx qy qz\n1305031102.5 1 2 3 0.5 -0.5 0.5 0.5\n1305031103 0 0 0 1 0 0 "
           "0\n",
           "1305031102500 1 2 3 -0.5 0.5 0.5 0.5\n1305031103000 0 0 0 0 0 0 1\n",
           "1305031102500000000 1 2 3 -0.5 0.5 0.5 0.5\n1305031103000000000 0 0 0 0 0 0 1\n",
           "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z "
           "[], v\n"
           "1305031102500000000,1,2,3,0.5,-0.5,0.5,0.5,9\n1305031103000000000,0,0,0,1,0,0,0,9\n",
           "#timestamp,tx,ty,tz,qx,qy,qz,qw\n1305031102.5,1,2,3,-0.5,0.5,0.5,0.5\n1305031103,0,0,0,0,0,0,1\n",
       }) {
    const auto list = read(text);
    ASSERT_TRUE(list) << text << to_string(list.error());
    const auto trajectory = read_trajectory(path_);
    ASSERT_TRUE(trajectory) << text << to_string(trajectory.error());
    for (const Trajectory& poses : {list->poses, *trajectory}) {
      ASSERT_EQ(poses.size(), 2U) << text;
      EXPECT_EQ(poses[0].stamp.ns, 1305031102500000000) << text;
      EXPECT_EQ(poses[1].stamp.ns, 1305031103000000000) << text;
      EXPECT_TRUE(poses[0].T_world_base.matrix().isApprox(turned.matrix(), 1e-12)) << text;
      EXPECT_TRUE(poses[1].T_world_base.matrix().isIdentity(1e-12)) << text;
    }
  }
  const auto small = read("timestamp_ns,x,y,z,qx,qy,qz,qw\n5000000,0,0,0,0,0,0,1\n");
  ASSERT_TRUE(small);
  EXPECT_EQ(small->poses[0].stamp.ns, 5000000);
}

}  // namespace
}  // namespace hm::detail
