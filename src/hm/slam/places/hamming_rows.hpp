#pragma once
#include <cstdint>
#include <span>

#include "hm/odometry/feature/feature.hpp"

namespace hm::detail {

/// Hamming distances of one descriptor to many; `bits` has as many places as `others`.
void hamming_row(const BinaryDescriptor& descriptor, std::span<const BinaryDescriptor> others,
                 std::span<std::uint16_t> bits);

/// The number of the nearest of `others` (the first of equals); `others` must not be empty.
std::size_t nearest_of(const BinaryDescriptor& descriptor, std::span<const BinaryDescriptor> others);

}  // namespace hm::detail
