#pragma once

namespace hm::test {

/// Whether this program is compiled for a sanitizer (HM_SANITIZE): code is several times slower, and memory
/// cannot be limited.
#ifdef HM_SANITIZED
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

/// Number of repetitions of a test: `usual`, or `sanitized` under sanitizers, where fewer repetitions reveal
/// the same errors.
constexpr int repetitions(int usual, int sanitized) { return kSanitized ? sanitized : usual; }

}  // namespace hm::test
