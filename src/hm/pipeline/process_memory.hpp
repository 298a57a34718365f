#pragma once
#include <cstddef>

namespace hm {

/// Bytes of this process that are in memory now (resident set), and the most there ever were; 0 where the
/// system does not say.
std::size_t resident_bytes();
std::size_t peak_resident_bytes();

}  // namespace hm
