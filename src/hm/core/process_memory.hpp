#pragma once
#include <cstddef>

namespace hm {

/// Resident set size of this process in bytes, now and at its peak; 0 where the system does not report it.
std::size_t resident_bytes();
std::size_t peak_resident_bytes();

/// Returns freed memory to the system. The allocator retains freed small blocks, which after a large map can
/// exceed the memory that the next stage needs.
void trim_memory();
/// Configures the allocator to return blocks of a few megabytes to the system as soon as they are freed. Call
/// once at program start.
void return_large_blocks();

}  // namespace hm
