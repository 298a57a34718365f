#include "hm/io/bytes/output_file.hpp"

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/map/map_file.hpp"
#include "hm/io/map/map_test_support.hpp"
#include "hm/io/testing/io_test_support.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

/// A folder with `victim`, a file of someone else's.
class OutputLinks : public ::testing::Test {
 protected:
  void SetUp() override { test::write_bytes(folder_ / "victim", "precious"); }
  void TearDown() override { EXPECT_EQ(test::read_bytes(folder_ / "victim"), "precious"); }
  const TemporaryFolder folder_;
};

TEST_F(OutputLinks, ALinkAtThePartialNameIsNotFollowed) {
  fs::create_symlink(folder_ / "victim", folder_ / "mesh.ply.partial");
  const auto written = write_file_text(folder_ / "mesh.ply", "mesh");
  ASSERT_FALSE(written);
  EXPECT_THAT(to_string(written.error()), HasSubstr("mesh.ply.partial: is in the way"));
  EXPECT_FALSE(fs::exists(folder_ / "mesh.ply"));
  EXPECT_TRUE(fs::is_symlink(folder_ / "mesh.ply.partial"));

  fs::create_symlink(folder_ / "victim", folder_ / "map.hmap.partial");
  const auto map = MapFile::create(folder_ / "map.hmap", test::example_header());
  ASSERT_FALSE(map);
  EXPECT_THAT(to_string(map.error()), HasSubstr("map.hmap.partial"));
}

TEST_F(OutputLinks, ALinkAtTheNameIsReplaced) {
  fs::create_symlink(folder_ / "victim", folder_ / "mesh.ply");
  ASSERT_TRUE(write_file_text(folder_ / "mesh.ply", "mesh"));
  EXPECT_FALSE(fs::is_symlink(folder_ / "mesh.ply"));
}

TEST_F(OutputLinks, AFolderOfResultsIsNoLink) {
  fs::create_directory(folder_ / "elsewhere");
  fs::create_symlink(folder_ / "elsewhere", folder_ / "pictures");
  const auto made = make_folder_in(folder_.path(), "pictures");
  ASSERT_FALSE(made);
  EXPECT_THAT(to_string(made.error()), HasSubstr("is a link"));
  EXPECT_TRUE(make_folder_in(folder_.path(), "others"));
}

TEST_F(OutputLinks, AFullDiskIsKnownBeforeTheEnd) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{20'000, 20'000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    OutputFile file(folder_ / "table.csv");
    std::size_t lines = 0;
    while (file.written() && lines < 1'000'000) file.write("a line of it\n"), ++lines;
    const bool told = file.written().error().message.find("cannot be written") != std::string::npos;
    ::_exit(told && lines < 200'000 && !file.finish() ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_FALSE(fs::exists(folder_ / "table.csv"));
}

TEST_F(OutputLinks, AStalePartialFileIsReplacedAndNothingIsLeft) {
  test::write_bytes(folder_ / "mesh.ply.partial", "half of an earlier run's mesh");
  ASSERT_TRUE(write_file_text(folder_ / "mesh.ply", "mesh"));
  EXPECT_EQ(test::read_bytes(folder_ / "mesh.ply"), "mesh");
  EXPECT_FALSE(fs::exists(folder_ / "mesh.ply.partial"));
}

}  // namespace
}  // namespace hm
