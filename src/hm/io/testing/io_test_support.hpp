#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "hm/core/rng.hpp"
#include "hm/core/testing/sanitized.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"

namespace hm::test {

inline std::string read_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  // Create a new file: some file systems wait for the disk when a file is truncated and rewritten.
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  std::ofstream(path, std::ios::binary) << bytes;
}

/// Calls `use` with many damaged versions of `bytes`: about a thousand prefixes at most, and `changes` random
/// changes of up to eight bytes; a third of both under sanitizers. Returns how many.
template <class Use>
int for_each_damaged(const std::string& bytes, int changes, Use use) {
  const std::size_t step = bytes.size() / static_cast<std::size_t>(repetitions(1000, 333)) + 1;
  int count = 0;
  for (std::size_t length = 0; length < bytes.size(); length += step, ++count) use(bytes.substr(0, length));
  Rng rng(7);
  for (int i = 0; i < repetitions(changes, changes / 3); ++i, ++count) {
    std::string damaged = bytes;
    const std::uint32_t places = 1 + rng.below(i % 2 == 0 ? 1 : 8);
    for (std::uint32_t k = 0; k < places; ++k)
      damaged[rng.below(static_cast<std::uint32_t>(bytes.size()))] = static_cast<char>(rng.below(256));
    use(damaged);
  }
  return count;
}

}  // namespace hm::test
