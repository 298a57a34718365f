#pragma once
#include <cstddef>

namespace hm {

/// Bytes of this process that are in memory now (resident set), and the most there ever were; 0 where the
/// system does not say.
std::size_t resident_bytes();
std::size_t peak_resident_bytes();

/// Hands freed memory back to the system. The allocator keeps what was freed in small pieces, and for a house
/// that is more than what comes next needs.
void trim_memory();
/// For the start of a program: blocks of a few megabytes go back to the system as soon as they are freed.
void return_large_blocks();

}  // namespace hm
