#pragma once
#include <cstdint>
#include <span>

#include "hm/odometry/feature/feature.hpp"

namespace hm::detail {

/// Computes the Hamming distances of one descriptor to many; `bits` must be as long as `others`.
void hamming_row(const BinaryDescriptor& descriptor, std::span<const BinaryDescriptor> others,
                 std::span<std::uint16_t> bits);

/// Index of the nearest of `others` (the first on ties); `others` must not be empty.
std::size_t nearest_of(const BinaryDescriptor& descriptor, std::span<const BinaryDescriptor> others);

}  // namespace hm::detail
