#pragma once

namespace hm::test {

/// Number of repetitions of a test: `usual`, or `sanitized` under sanitizers, where code is several times
/// slower and fewer repetitions reveal the same errors.
constexpr int repetitions([[maybe_unused]] int usual, [[maybe_unused]] int sanitized) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return sanitized;
#else
  return usual;
#endif
}

}  // namespace hm::test
