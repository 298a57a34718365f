#pragma once
#include <cstddef>

namespace hm {

/// Resident set size of this process in bytes, now and at its peak; 0 where the system does not report it.
std::size_t resident_bytes();
std::size_t peak_resident_bytes();
/// Bytes in blocks that the program holds from the allocator, on all threads, and the few that each thread's
/// cache of freed blocks keeps; unlike the resident set without what was freed and not given back to the
/// system. 0 where the C library does not report it (glibc does since 2.33).
std::size_t heap_bytes();

/// Returns freed memory to the system. The allocator retains freed small blocks, which after a large map can
/// exceed the memory that the next stage needs.
void trim_memory();
/// Configures the allocator to keep up to 64 MB of freed memory, from which the next frame's images and the
/// next mesh page are taken: fresh pages of the system cost a fault and a clearing for every 4 kB. Blocks
/// over 32 MB and what is freed beyond that go back at once. Call once at program start.
void keep_freed_memory();

}  // namespace hm
