#include "hm/io/bytes/append_file.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <future>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"

namespace hm {
namespace {

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

std::string content_of(const std::filesystem::path& path) {
  const auto bytes = read_file_bytes(path).value();
  return {bytes.begin(), bytes.end()};
}

TEST(AppendFile, GrowsAndIsContinuedWhereItIsToldTo) {
  const TemporaryFolder folder;
  {
    auto file = AppendFile::create(folder / "a").value();
    file.append(bytes_of("first "));
    EXPECT_TRUE(file.flush());
    EXPECT_EQ(content_of(folder / "a"), "first ") << "on disk while it is open";
    std::filesystem::rename(folder / "a", folder / "b");
    file.append(bytes_of("second"));
    EXPECT_EQ(file.size(), 12u);
    EXPECT_TRUE(file.flush());
    EXPECT_TRUE(file.sync());
  }
  EXPECT_EQ(content_of(folder / "b"), "first second") << "it was renamed while it was open";
  auto file = AppendFile::continue_at(folder / "b", 6).value();
  EXPECT_EQ(content_of(folder / "b"), "first ") << "the rest is cut off";
  file.append(bytes_of("new"));
  EXPECT_TRUE(file.flush());
  EXPECT_EQ(content_of(folder / "b"), "first new");
}

/// As a SLAM run does: its journal goes to disk while tracking adds frames.
TEST(AppendFile, IsSyncedByAnotherThreadWhileItGrows) {
  const TemporaryFolder folder;
  auto file = AppendFile::create(folder / "a").value();
  for (std::size_t save = 1; save <= 8; ++save) {
    EXPECT_TRUE(file.flush());
    auto synced = std::async(std::launch::async, [&] { return file.sync(); });
    for (int i = 0; i < 50; ++i) file.append(bytes_of("a frame of it "));
    EXPECT_TRUE(synced.get());
  }
  EXPECT_TRUE(file.flush());
  EXPECT_EQ(content_of(folder / "a").size(), file.size());
}

TEST(AppendFile, AFullDiskIsKnownWithoutAFlush) {
  const TemporaryFolder folder;
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{20'000, 20'000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    auto file = AppendFile::create(folder / "a").value();
    while (file.written() && file.size() < 1'000'000) file.append(bytes_of("a frame of it "));
    ::_exit(file.size() > 20'000 && file.size() < 40'000 && !file.flush() ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

TEST(AppendFile, RefusesLinksAndWhatIsTooShort) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_file_text(folder / "target", "precious"));
  std::filesystem::create_symlink(folder / "target", folder / "link");
  EXPECT_FALSE(AppendFile::create(folder / "link"));
  EXPECT_FALSE(AppendFile::continue_at(folder / "link", 0));
  EXPECT_EQ(content_of(folder / "target"), "precious");
  const auto cut = AppendFile::continue_at(folder / "target", 100);
  ASSERT_FALSE(cut);
  EXPECT_EQ(cut.error().code, ErrorCode::kCorrupted);
  EXPECT_EQ(content_of(folder / "target"), "precious") << "it is left as it was";
  EXPECT_FALSE(AppendFile::continue_at(folder / "nothing", 0));
}

}  // namespace
}  // namespace hm
