#pragma once
#include <sys/resource.h>

#include <cstddef>
#include <fstream>
#include <string>

#include "hm/core/testing/sanitized.hpp"

namespace hm::test {

/// Bytes that this process may write to and that are its own.
inline std::size_t data_bytes() {
  std::ifstream status("/proc/self/status");
  std::size_t kb = 0;
  for (std::string word; status >> word;)
    if (word == "VmData:") status >> kb;
  return 1024 * kb;
}

/// Lets this process have `bytes` more than it has now. For the body of a death test: there is no way back.
/// The style must be "threadsafe": what earlier tests have freed would not count otherwise.
inline void limit_memory_to_what_is_there_and(std::size_t bytes) {
  const rlimit limit{data_bytes() + bytes, data_bytes() + bytes};
  setrlimit(RLIMIT_DATA, &limit);
}

/// A sanitizer needs more memory than such a limit leaves.
inline constexpr bool kCanLimitMemory = !kSanitized;

}  // namespace hm::test
