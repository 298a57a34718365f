#pragma once
#include <cstdint>

namespace hm::board {

inline constexpr std::uint32_t kStackPattern = 0xA5A5A5A5;
/// Bytes of the stack that have never been used.
std::uint32_t stack_unused();

}  // namespace hm::board
