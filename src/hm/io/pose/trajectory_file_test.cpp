#include "hm/io/pose/trajectory_file.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <regex>
#include <sstream>

#include "hm/core/rng.hpp"
#include "hm/io/testing/io_test_support.hpp"
#include "hm/io/testing/real_data_test_support.hpp"

namespace hm {
namespace {

using test::write_bytes;
using testing::HasSubstr;

Trajectory random_trajectory(int count, std::uint64_t seed) {
  Rng rng(seed);
  Trajectory trajectory;
  Time stamp{1305031102160407001};
  for (int i = 0; i < count; ++i) {
    stamp.ns += 1 + rng.below(1'000'000'000);
    Vec3 axis(rng.normal(), rng.normal(), rng.normal());
    const Mat3 rotation = so3_exp(axis.normalized() * rng.uniform(0, 3.14));
    trajectory.push_back({stamp, SE3(rotation, Vec3(rng.normal(0, 30), rng.normal(), rng.normal(0, 1e-3)))});
  }
  return trajectory;
}

void expect_equal(const Trajectory& a, const Trajectory& b, double tolerance) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_LT((a[i].T_world_base.matrix() - b[i].T_world_base.matrix()).cwiseAbs().maxCoeff(), tolerance)
        << i;
}

TEST(TrajectoryFile, TumRoundTripIsExactInTime) {
  const TemporaryFolder folder;
  Trajectory trajectory = random_trajectory(200, 1);
  trajectory.insert(trajectory.begin(), {Time{-1'500'000'000}, SE3()});
  ASSERT_TRUE(write_tum_trajectory(folder / "t.txt", trajectory));
  EXPECT_EQ(folder.file_count(), 1u);
  const auto read = read_trajectory(folder / "t.txt");
  ASSERT_TRUE(read) << to_string(read.error());
  expect_equal(*read, trajectory, 5e-9);
  for (std::size_t i = 0; i < read->size(); ++i) EXPECT_EQ((*read)[i].stamp, trajectory[i].stamp);
}

TEST(TrajectoryFile, AsInTumFileIsToTheBitWhatIsReadBack) {
  const TemporaryFolder folder;
  const Trajectory trajectory = random_trajectory(500, 4);
  const auto path = folder.path() / "poses.tum";
  ASSERT_TRUE(write_tum_trajectory(path, trajectory).has_value());
  const auto read = read_trajectory(path);
  ASSERT_TRUE(read.has_value());
  const Trajectory rounded = as_in_tum_file(trajectory);
  ASSERT_EQ(rounded.size(), read->size());
  for (std::size_t i = 0; i < rounded.size(); ++i) {
    EXPECT_EQ(rounded[i].stamp, (*read)[i].stamp);
    EXPECT_EQ(rounded[i].T_world_base.matrix(), (*read)[i].T_world_base.matrix()) << i;
    EXPECT_NE(rounded[i].T_world_base.matrix(), trajectory[i].T_world_base.matrix()) << i;
  }
}

std::string rows_of(const Mat4& matrix, const char* between) {
  std::string text;
  for (int i = 0; i < 16; ++i)
    text += fmt::format("{:.17g}{}", matrix(i / 4, i % 4), i % 4 == 3 ? between : " ");
  return text;
}

TEST(TrajectoryFile, MatricesOfFramesHaveNoStamps) {
  const TemporaryFolder folder;
  const Trajectory trajectory = random_trajectory(3, 5);
  std::string lines, blocks;
  for (std::size_t i = 0; i < 3; ++i) {
    const Mat4 matrix = trajectory[i].T_world_base.matrix();
    lines += rows_of(matrix, " ") + "\n";
    blocks += fmt::format("{0} {0} {1}\n", 2 * i, 2 * i + 1) + rows_of(matrix, "\n");  // every other frame
  }
  write_bytes(folder / "traj.txt", lines);
  write_bytes(folder / "poses.log", blocks);
  for (const auto& [name, step] : {std::pair{"traj.txt", 1}, std::pair{"poses.log", 2}}) {
    const auto read = read_trajectory(folder / name);
    ASSERT_TRUE(read) << to_string(read.error());
    expect_equal(*read, trajectory, 1e-9);
    for (int i = 0; i < 3; ++i)
      EXPECT_EQ((*read)[static_cast<std::size_t>(i)].stamp, Time::from_seconds(i * step)) << name;
  }
}

TEST(TrajectoryFile, PosesWithoutStampsAreThoseOfTheFrames) {
  const TemporaryFolder folder;
  std::vector<Time> stamps;
  for (const double at : {7.0, 7.5, 9.0}) stamps.push_back(Time::from_seconds(at));
  const std::string matrix = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";
  const std::string rows = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
  write_bytes(folder / "traj.txt", matrix + "\n" + matrix + "\n" + matrix + "\n");
  write_bytes(folder / "some.log", "0 0 1\n" + rows + "2 2 3\n" + rows);
  write_bytes(folder / "short.txt", matrix + "\n" + matrix + "\n");
  write_bytes(folder / "beyond.log", "3 3 4\n" + rows);
  write_bytes(folder / "stamped.txt", "7.25 0 0 0 0 0 0 1\n");
  const auto stamps_in = [&](const char* name) {
    std::vector<Time> found;
    const auto read = read_trajectory_of(folder / name, stamps);
    EXPECT_TRUE(read) << to_string(read.error());
    for (const StampedPose& pose : read.value_or(Trajectory())) found.push_back(pose.stamp);
    return found;
  };
  EXPECT_EQ(stamps_in("traj.txt"), stamps);
  EXPECT_EQ(stamps_in("some.log"), (std::vector<Time>{stamps[0], stamps[2]}));
  EXPECT_EQ(stamps_in("stamped.txt"), (std::vector<Time>{Time::from_seconds(7.25)}));
  EXPECT_THAT(to_string(read_trajectory_of(folder / "short.txt", stamps).error()),
              HasSubstr("holds 2 poses without stamps, and the recording 3 frames"));
  EXPECT_THAT(to_string(read_trajectory_of(folder / "beyond.log", stamps).error()),
              HasSubstr("has a pose of frame 3, and the recording 3 frames"));
}

TEST(TrajectoryFile, RedwoodBlocksThatAreNoneAreErrorsWithTheirLine) {
  const TemporaryFolder folder;
  const std::string good = "0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
  for (const auto& [text, wanted] :
       {std::pair<std::string, std::string>{good + "1 1 2\n1 0 0 0\n", "t.log:7: the last matrix is cut off"},
        {good + "1 1 2\n", "t.log:6: the last matrix is cut off"},
        {good + "1 0 0 0\n", "t.log:6: 4 columns instead of 3"},
        {good + "1 1 2\n1 0 0\n", "t.log:7: 3 columns instead of 4"},
        {"0 1 2\n", "t.log:1: '0 1' is a pair of frames"},
        {"0 x 2\n", "t.log:1: '0 x' is a pair of frames"},
        {"-1 0 1\n", "t.log:1: '-1' is no frame number"},
        {"9999999999 0 1\n", "t.log:1: '9999999999' is no frame number"},
        {good + good, "t.log:10: the stamp does not come after"},
        {"0 0 1\n1 0 0 0\n0 2 0 0\n0 0 1 0\n0 0 0 1\n", "t.log:5: a pose is not rigid"}}) {
    write_bytes(folder / "t.log", text);
    const auto read = read_trajectory(folder / "t.log");
    ASSERT_FALSE(read) << text;
    EXPECT_THAT(to_string(read.error()), HasSubstr(wanted));
  }
}

TEST(TrajectoryFile, TumLinesHaveTheStrictForm) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_tum_trajectory(folder / "t.txt", random_trajectory(50, 2)));
  std::istringstream text(test::read_bytes(folder / "t.txt"));
  const std::regex form(R"(-?\d+\.\d{9}( -?\d+\.\d{9}){6} \d+\.\d{9})");  // the last, qw, is not negative
  int lines = 0;
  for (std::string line; std::getline(text, line); ++lines) EXPECT_TRUE(std::regex_match(line, form)) << line;
  EXPECT_EQ(lines, 50);
}

TEST(TrajectoryFile, KittiRoundTrip) {
  const TemporaryFolder folder;
  const Trajectory trajectory = random_trajectory(50, 3);
  ASSERT_TRUE(write_kitti_trajectory(folder / "t.kitti", trajectory));
  const auto read = read_trajectory(folder / "t.kitti");
  ASSERT_TRUE(read) << to_string(read.error());
  expect_equal(*read, trajectory, 5e-9);
  EXPECT_EQ((*read)[7].stamp, Time::from_seconds(7));
}

TEST(TrajectoryFile, ReadsEveryDialect) {
  const TemporaryFolder folder;
  // A quarter turn around z, written in every format.
  const std::string half = "0.70710678118654752";
  write_bytes(folder / "tum",
              "# stamp tx ty tz qx qy qz qw\r\n\r\n  1.5\t1 +2e0  3 0 0 " + half + " " + half + "  \r\n");
  write_bytes(folder / "euroc", "#timestamp [ns],p_x [m],p_y,p_z,q_w,q_x,q_y,q_z,v_x\n1500000000, 1,2,3," +
                                    half + ",0,0," + half + ",9\n");
  write_bytes(folder / "kitti", "0 -1 0 1 1 0 0 2 0 0 1 3");
  for (const char* name : {"tum", "euroc", "kitti"}) {
    const auto read = read_trajectory(folder / name);
    ASSERT_TRUE(read) << to_string(read.error());
    ASSERT_EQ(read->size(), 1u);
    const SE3& pose = read->front().T_world_base;
    EXPECT_LT((pose * Vec3(1, 0, 0) - Vec3(1, 3, 3)).norm(), 1e-12) << name;
    EXPECT_EQ(read->front().stamp.ns, std::string_view(name) == "kitti" ? 0 : 1'500'000'000) << name;
  }
}

TEST(TrajectoryFile, ErrorsNameTheLine) {
  const TemporaryFolder folder;
  const std::string good = "# c\n1 0 0 0 0 0 0 1\n";
  struct Case {
    std::string text, message;
  };
  const std::vector<Case> cases{{good + "2 0 0 0 0 0 0\n", "7 columns instead of 8"},
                                {good + "2 0 0 0 0 0 0 1 1\n", "9 columns instead of 8"},
                                {good + "2 0 0 nan 0 0 0 1\n", "'nan' is no finite number"},
                                {good + "2 0 0 0x 0 0 0 1\n", "'0x'"},
                                {good + "2 0 0 0 0 0 0 0\n", "length is 0"},
                                {good + "2 0 0 0 0 0 1 1\n", "length is 1.41"},
                                {good + "1 0 0 0 0 0 0 1\n", "stamp"},
                                {good + "0.5 0 0 0 0 0 0 1\n", "stamp"},
                                {good + "13050311021604070000 0 0 0 0 0 0 1\n", "no stamp in seconds"},
                                {"# a\n\n1 0 0 0 0 1 0 0 0 0 -1 0\n", "mirror"},
                                {"# a\n\n1,0,0,0,0,0,0\n", "7 columns where"},
                                {"# a\n\n1 0 0 0\n", "positions without orientations"}};
  for (const Case& bad : cases) {
    write_bytes(folder / "t.txt", bad.text);
    const auto read = read_trajectory(folder / "t.txt");
    ASSERT_FALSE(read) << bad.text;
    EXPECT_THAT(to_string(read.error()), HasSubstr("t.txt:3")) << bad.text;
    EXPECT_THAT(to_string(read.error()), HasSubstr(bad.message)) << bad.text;
  }
  write_bytes(folder / "t.txt", "# only a comment\n");
  EXPECT_FALSE(read_trajectory(folder / "t.txt"));
  EXPECT_EQ(read_trajectory(folder / "none").error().code, ErrorCode::kNotFound);
  EXPECT_FALSE(read_trajectory(folder / ""));
}

TEST(TrajectoryFile, RepeatedStampsAreLeftOutAndCountedWhereAskedFor) {
  const TemporaryFolder folder;
  const std::string pose = " 0 0 0 0 0 0 1\n";
  write_bytes(folder / "t.txt", "1" + pose + "2" + pose + "2" + pose + "0.5" + pose + "3" + pose);
  EXPECT_FALSE(read_trajectory(folder / "t.txt"));
  const auto read = read_trajectory_file(folder / "t.txt");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_TRUE(read->has_stamps);
  ASSERT_EQ(read->poses.size(), 3U);
  EXPECT_EQ(read->poses.back().stamp, Time::from_seconds(3));
  ASSERT_EQ(read->skipped.size(), 1U);
  EXPECT_EQ(to_string(read->skipped.front()),
            "2 lines of t.txt left out: stamps that run backwards or repeat (first: t.txt:3)");
  write_bytes(folder / "k.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n");
  const auto bare = read_trajectory_file(folder / "k.txt");
  ASSERT_TRUE(bare);
  EXPECT_FALSE(bare->has_stamps || bare->names_frames);
}

TEST(TrajectoryFile, WritingNowhereIsAnErrorAndLeavesNothing) {
  const TemporaryFolder folder;
  const auto nowhere = write_tum_trajectory(folder / "no/t.txt", random_trajectory(2, 4));
  ASSERT_FALSE(nowhere);
  EXPECT_THAT(to_string(nowhere.error()), HasSubstr("no/t.txt"));
  EXPECT_EQ(folder.file_count(), 0u);
}

TEST(TrajectoryFile, SurvivesDamage) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_tum_trajectory(folder / "t.txt", random_trajectory(8, 5)));
  int refused = 0;
  const int cases =
      test::for_each_damaged(test::read_bytes(folder / "t.txt"), 600, [&](const std::string& damaged) {
        write_bytes(folder / "d.txt", damaged);
        const auto read = read_trajectory(folder / "d.txt");
        refused += read ? 0 : 1;
        if (!read) return;
        for (const StampedPose& pose : *read) EXPECT_TRUE(is_rigid(pose.T_world_base));
      });
  EXPECT_GT(refused, cases / 3);
}

TEST(TrajectoryFile, ReadsARealGroundTruth) {
  const auto path = real_data_folder() / "rgbd/tum_fr1_xyz/groundtruth.txt";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  const auto read = read_trajectory(path);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_GT(read->size(), 100u);
  EXPECT_LT(path_length(*read), 10);
}

}  // namespace
}  // namespace hm
