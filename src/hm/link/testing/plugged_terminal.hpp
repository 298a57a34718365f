#pragma once
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace hm::link_testing {

/// A device that can be unplugged: a pseudo-terminal behind a symbolic link of a fixed name.
class PluggedTerminal {
 public:
  PluggedTerminal() {
    std::string pattern = ::testing::TempDir() + "hm_terminal_XXXXXX";
    folder_ = ::mkdtemp(pattern.data());
    plug_in();
  }
  ~PluggedTerminal() {
    unplug();
    std::filesystem::remove_all(folder_);
  }
  PluggedTerminal(const PluggedTerminal&) = delete;
  PluggedTerminal& operator=(const PluggedTerminal&) = delete;

  void plug_in() {
    other_side_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    ASSERT_GE(other_side_, 0);
    ASSERT_EQ(::grantpt(other_side_), 0);
    ASSERT_EQ(::unlockpt(other_side_), 0);
    std::filesystem::create_symlink(::ptsname(other_side_), path());
  }
  void unplug() {
    if (other_side_ >= 0) ::close(other_side_);
    other_side_ = -1;
    std::filesystem::remove(path());
  }
  void send(std::span<const std::uint8_t> bytes) const {
    ASSERT_EQ(::write(other_side_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  [[nodiscard]] std::vector<std::uint8_t> receive() const {
    std::array<std::uint8_t, 4096> buffer{};
    const ssize_t count = ::read(other_side_, buffer.data(), buffer.size());
    return count > 0 ? std::vector<std::uint8_t>(buffer.begin(), buffer.begin() + count)
                     : std::vector<std::uint8_t>{};
  }
  [[nodiscard]] bool is_plugged() const { return other_side_ >= 0; }
  [[nodiscard]] std::string path() const { return folder_ + "/device"; }

 private:
  std::string folder_;
  int other_side_ = -1;
};

}  // namespace hm::link_testing
