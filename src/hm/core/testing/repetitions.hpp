#pragma once

namespace hm::test {

/// How often a test repeats something, or how much of it, where less shows the same errors of memory and
/// order: less under sanitizers, where code is several times slower.
constexpr int repetitions([[maybe_unused]] int usual, [[maybe_unused]] int sanitized) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return sanitized;
#else
  return usual;
#endif
}

}  // namespace hm::test
