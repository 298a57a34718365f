#include "hm/pipeline/common/result_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "hm/io/bytes/file_bytes.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

class ResultFolderTest : public testing::Test {
 protected:
  void SetUp() override {
    place_ = fs::path(testing::TempDir()) / fmt::format("hm_result_folder_{}", getpid());
    fs::remove_all(place_);
    fs::create_directory(place_);
  }
  void TearDown() override { fs::remove_all(place_); }

  [[nodiscard]] ResultFolderRequest request(const std::string& verb,
                                            ExistingResult existing = ExistingResult::kRefuse) const {
    return {place_ / "out", existing, verb, place_ / "recording", "1.2.3"};
  }
  static fs::path write(const fs::path& path, const std::string& text) {
    fs::create_directories(path.parent_path());
    EXPECT_TRUE(write_file_text(path, text));
    return path;
  }
  static std::string text_of(const fs::path& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  /// A run that writes these files and ends.
  void run(const std::string& verb, ExistingResult existing, const std::vector<std::string>& names) const {
    auto folder = ResultFolder::open(request(verb, existing));
    ASSERT_TRUE(folder) << to_string(folder.error());
    std::vector<fs::path> files;
    for (const std::string& name : names) files.push_back(write(folder->staging() / name, verb));
    ASSERT_TRUE(folder->publish(files, RunState::kComplete));
  }

  fs::path place_;
};

TEST_F(ResultFolderTest, FilesAppearWhenTheyArePublished) {
  auto folder = ResultFolder::open(request("slam"));
  ASSERT_TRUE(folder);
  std::vector<fs::path> files{write(folder->staging() / "a.txt", "a"), folder->staging() / "pictures"};
  write(folder->staging() / "pictures/b.png", "b");
  EXPECT_FALSE(fs::exists(place_ / "out/a.txt"));
  ASSERT_TRUE(folder->publish(files, RunState::kStopped));
  EXPECT_THAT(files, testing::ElementsAre(place_ / "out/a.txt", place_ / "out/pictures"));
  EXPECT_EQ(text_of(place_ / "out/pictures/b.png"), "b");
  const auto record = read_run_record(place_ / "out");
  ASSERT_TRUE(record && *record);
  EXPECT_EQ((*record)->verb, "slam");
  EXPECT_EQ((*record)->state, RunState::kStopped);
  EXPECT_EQ((*record)->program_version, "1.2.3");
  EXPECT_EQ((*record)->recording, fs::weakly_canonical(place_ / "recording"));
  EXPECT_THAT((*record)->files, testing::ElementsAre("a.txt", "pictures/b.png"));
}

TEST_F(ResultFolderTest, ARunThatPublishesNothingLeavesNothing) {
  { ASSERT_TRUE(ResultFolder::open({place_ / "x/y/z", ExistingResult::kRefuse, "slam", {}, {}})); }
  EXPECT_FALSE(fs::exists(place_ / "x"));
  run("slam", ExistingResult::kRefuse, {"a.txt"});
  {
    auto folder = ResultFolder::open(request("laser", ExistingResult::kOverwrite));
    ASSERT_TRUE(folder);
    write(folder->staging() / "a.txt", "new");
  }
  EXPECT_EQ(text_of(place_ / "out/a.txt"), "slam");
  EXPECT_FALSE(fs::exists(place_ / "out/.partial"));
}

TEST_F(ResultFolderTest, AnEarlierResultIsRefusedReplacedOrContinued) {
  run("slam", ExistingResult::kRefuse, {"a.txt", "b.txt", "pictures/c.png"});
  write(place_ / "out/mine.txt", "mine");
  const auto refused = ResultFolder::open(request("slam"));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
  EXPECT_THAT(refused.error().message, testing::HasSubstr("the result of `hm slam`"));
  const auto other = ResultFolder::open(request("reconstruct", ExistingResult::kResume));
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message, testing::HasSubstr("`hm reconstruct --resume` cannot continue"));
  {
    const auto same = ResultFolder::open(request("slam", ExistingResult::kResume));
    ASSERT_TRUE(same);
    ASSERT_TRUE(same->resumed());
    EXPECT_THAT(same->resumed()->files, testing::SizeIs(3));
  }
  run("laser", ExistingResult::kOverwrite, {"b.txt", "d.txt"});
  EXPECT_FALSE(fs::exists(place_ / "out/a.txt"));
  EXPECT_FALSE(fs::exists(place_ / "out/pictures"));
  EXPECT_EQ(text_of(place_ / "out/b.txt"), "laser");
  EXPECT_EQ(text_of(place_ / "out/mine.txt"), "mine");
}

TEST_F(ResultFolderTest, OneRunAtATime) {
  const auto first = ResultFolder::open(request("slam"));
  ASSERT_TRUE(first);
  const auto second = ResultFolder::open(request("slam", ExistingResult::kOverwrite));
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().message, testing::HasSubstr("another run writes into this folder"));
}

TEST_F(ResultFolderTest, ARecordCannotHaveOtherFilesRemoved) {
  write(place_ / "precious.txt", "precious");
  write(place_ / "out/run.json",
        R"({"verb": "slam", "state": "complete", "files": ["../precious.txt", "/tmp/x", ""]})");
  run("slam", ExistingResult::kOverwrite, {"a.txt"});
  EXPECT_EQ(text_of(place_ / "precious.txt"), "precious");
  write(place_ / "out/run.json", "{");
  EXPECT_FALSE(ResultFolder::open(request("slam")));
  EXPECT_TRUE(ResultFolder::open(request("slam", ExistingResult::kOverwrite)));
}

TEST_F(ResultFolderTest, ALinkInThePlaceOfUnfinishedFilesIsNotFollowed) {
  write(place_ / "elsewhere/a.txt", "precious");
  fs::create_directory(place_ / "out");
  fs::create_directory_symlink(place_ / "elsewhere", place_ / "out/.partial");
  run("slam", ExistingResult::kRefuse, {"a.txt"});
  EXPECT_EQ(text_of(place_ / "elsewhere/a.txt"), "precious");
  EXPECT_EQ(text_of(place_ / "out/a.txt"), "slam");
}

}  // namespace
}  // namespace hm
