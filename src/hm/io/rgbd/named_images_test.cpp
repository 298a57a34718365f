#include "hm/io/rgbd/named_images.hpp"

#include <gtest/gtest.h>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"

namespace hm::detail {
namespace {

namespace fs = std::filesystem;

/// Empty files: only their names are read.
void touch(const fs::path& folder, const std::vector<std::string>& names) {
  fs::create_directories(folder);
  for (const std::string& name : names) ASSERT_TRUE(write_file_text(folder / name, "x"));
}

std::vector<double> seconds_of(const ImageList& list) {
  std::vector<double> seconds;
  for (const StampedImage& picture : list.images) seconds.push_back(picture.stamp.seconds());
  return seconds;
}

TEST(NamedImages, NumbersAreFramesAtTheRate) {
  const TemporaryFolder folder;
  touch(folder.path() / "depth", {"000010.png", "000002.png", "000000.png", "notes.txt"});
  touch(folder.path() / "color", {"0.jpg", "2.jpg"});
  ASSERT_TRUE(has_named_images(folder.path()));
  const auto named = list_named_images(folder.path(), 20);
  ASSERT_TRUE(named) << to_string(named.error());
  EXPECT_FALSE(named->has_stamps);
  EXPECT_EQ(seconds_of(named->lists.depth), (std::vector<double>{0, 0.1, 0.5}));
  EXPECT_EQ(seconds_of(named->lists.color), (std::vector<double>{0, 0.1}));
  EXPECT_EQ(named->lists.depth.images[2].path, "depth/000010.png");
  EXPECT_TRUE(named->lists.depth.skipped.empty());
}

TEST(NamedImages, WordsBeforeTheNumberAndTimesOfTheDeviceBehindItAreNotRead) {
  for (const auto& [a, b] :
       std::vector<std::pair<std::string, std::string>>{{"depth_000002", "depth_000010"},
                                                        {"frame2", "frame10"},
                                                        {"0000002-000000066733", "0000010-000000333667"}}) {
    const TemporaryFolder folder;
    touch(folder.path() / "depth", {b + ".png", a + ".png"});
    ASSERT_TRUE(has_named_images(folder.path())) << a;
    const auto named = list_named_images(folder.path(), 20);
    ASSERT_TRUE(named) << a;
    EXPECT_EQ(seconds_of(named->lists.depth), (std::vector<double>{0.1, 0.5})) << a;
  }
}

TEST(NamedImages, StampsInSecondsAndInPartsOfThem) {
  struct Case {
    std::string a, b;
    std::int64_t beyond_a_ns = 0, beyond_b_ns = 0;
  };
  for (const auto& [a, b, beyond_a_ns, beyond_b_ns] :
       std::vector<Case>{{"1305031102.100000", "1305031102.350000"},
                         {"1305031102100", "1305031102350"},
                         {"1305031102100.250000", "1305031102350.750000", 250'000, 750'000},
                         {"depth_1305031102100", "depth_1305031102350"},
                         {"1305031102100000", "1305031102350000"},
                         {"1305031102100000000", "1305031102350000000"}}) {
    const TemporaryFolder folder;
    touch(folder.path() / "depth", {b + ".png", a + ".png"});
    const auto named = list_named_images(folder.path(), 30);
    ASSERT_TRUE(named) << a;
    EXPECT_TRUE(named->has_stamps) << a;
    ASSERT_EQ(named->lists.depth.images.size(), 2U) << a;
    EXPECT_EQ(named->lists.depth.images[0].stamp.ns, 1'305'031'102'100'000'000 + beyond_a_ns) << a;
    EXPECT_EQ(named->lists.depth.images[1].stamp.ns, 1'305'031'102'350'000'000 + beyond_b_ns) << a;
    EXPECT_TRUE(named->lists.color.images.empty());
  }
}

TEST(NamedImages, OtherNamesAndRepeatedNumbersAreCounted) {
  const TemporaryFolder folder;
  touch(folder.path() / "depth", {"1.png", "01.png", "2.png", "mask.png", "3.4.5.png"});
  const auto named = list_named_images(folder.path(), 30);
  ASSERT_TRUE(named);
  EXPECT_EQ(named->lists.depth.images.size(), 2U);
  ASSERT_EQ(named->lists.depth.skipped.size(), 2U);
  EXPECT_EQ(named->lists.depth.skipped[0].count, 2U);
  EXPECT_EQ(named->lists.depth.skipped[1].count, 1U);
}

TEST(NamedImages, ReplicaHasBothKindsInOneFolderAndOnePoseALine) {
  const TemporaryFolder folder;
  touch(folder.path() / "results",
        {"depth000000.png", "frame000000.jpg", "depth000001.png", "frame000001.jpg"});
  ASSERT_TRUE(write_file_text(folder.path() / "traj.txt",
                              "1 0 0 1 0 1 0 2 0 0 1 3 0 0 0 1\n1 0 0 4 0 1 0 5 0 0 1 6 0 0 0 1\n"));
  ASSERT_TRUE(has_named_images(folder.path()));
  const auto named = list_named_images(folder.path(), 10);
  ASSERT_TRUE(named);
  EXPECT_EQ(seconds_of(named->lists.depth), (std::vector<double>{0, 0.1}));
  EXPECT_EQ(seconds_of(named->lists.color), (std::vector<double>{0, 0.1}));
  EXPECT_EQ(named->lists.depth.images[1].path, "results/depth000001.png");
  EXPECT_EQ(named->lists.color.images[1].path, "results/frame000001.jpg");
  const std::vector<Time> stamps{Time::from_seconds(0), Time::from_seconds(0.1)};
  const auto poses = find_named_poses(folder.path(), stamps, 10);
  ASSERT_TRUE(poses && *poses);
  EXPECT_EQ((*poses)->source, "traj.txt");
  ASSERT_EQ((*poses)->list.poses.size(), 2U);
  EXPECT_EQ((*poses)->list.poses[1].stamp, Time::from_seconds(0.1));
  EXPECT_EQ((*poses)->list.poses[1].T_world_base.translation(), Vec3(4, 5, 6));
  ASSERT_TRUE(write_file_text(folder.path() / "traj.txt", "1 0 0 1 0 1\n"));
  EXPECT_FALSE(find_named_poses(folder.path(), stamps, 10));
}

TEST(NamedImages, PosesOfScanNetAreMatricesNamedAsTheImages) {
  const TemporaryFolder folder;
  touch(folder.path() / "depth", {"0.png", "1.png", "2.png", "10.png"});
  EXPECT_FALSE(find_named_poses(folder.path(), {}, 10)->has_value());
  fs::create_directories(folder.path() / "pose");
  const auto write = [&](const char* name, const char* text) {
    ASSERT_TRUE(write_file_text(folder.path() / "pose" / name, text));
  };
  write("10.txt", "1 0 0 7\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  write("0.txt", "1 0 0 5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  write("1.txt", "-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n");
  write("2.txt", "1 0 0\n");
  write("notes.txt", "none\n");
  write("0010.txt", "1 0 0 7\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  const auto poses = find_named_poses(folder.path(), {}, 10);
  ASSERT_TRUE(poses && *poses);
  const PoseList& list = (*poses)->list;
  EXPECT_EQ((*poses)->source, "pose/");
  ASSERT_EQ(list.poses.size(), 2U);
  EXPECT_EQ(list.poses[1].stamp, Time::from_seconds(1.0));
  EXPECT_EQ(list.poses[1].T_world_base.translation().x(), 7);
  EXPECT_EQ(list.lost, (std::vector<Time>{Time::from_seconds(0.1), Time::from_seconds(0.2)}));
  EXPECT_FALSE(pose_between(list, Time::from_seconds(0.5), Duration::from_seconds(2)));
  std::size_t skipped = 0;
  for (const SkippedLines& lines : list.skipped) {
    skipped += lines.count;
    if (lines.reason == SkippedLines::Reason::kNotFinite) {
      EXPECT_EQ(lines.place, "1.txt");
    }
  }
  EXPECT_EQ(skipped, 4U);
}

TEST(NamedImages, ColorOfReplicaIsNotThatOfAnotherLayout) {
  const TemporaryFolder folder;
  touch(folder.path() / "depth", {"1.png"});
  touch(folder.path() / "results", {"frame1.png"});
  EXPECT_TRUE(list_named_images(folder.path(), 30)->lists.color.images.empty());
  touch(folder.path() / "results", {"depth1.png"});
  const auto named = list_named_images(folder.path(), 30);
  ASSERT_TRUE(named);
  EXPECT_EQ(named->lists.depth.images[0].path, "depth/1.png");
}

TEST(NamedImages, AListGoesBeforeNames) {
  const TemporaryFolder folder;
  EXPECT_FALSE(has_named_images(folder.path()));
  touch(folder.path() / "depth", {"mask.png"});
  EXPECT_FALSE(has_named_images(folder.path()));
  EXPECT_EQ(list_named_images(folder.path(), 30).error().code, ErrorCode::kNotFound);
  touch(folder.path() / "depth", {"1.png"});
  EXPECT_TRUE(has_named_images(folder.path()));
  touch(folder.path(), {"depth.txt"});
  EXPECT_FALSE(has_named_images(folder.path()));
}

}  // namespace
}  // namespace hm::detail
