#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string_view>

#include "hm/core/result.hpp"

/// OctoMap's file format: what its reader and writer share. A text header, then the nodes depth first;
/// children in the order of their places: bit 0 of the place is the upper half in x, bit 1 in y, bit 2 in z.
///   .bt  a node is 16 bits, two for each child: nothing, free leaf, occupied leaf, node with children
///   .ot  a node is its log-odds (float) and a byte with a bit for each child that is there
namespace hm::octree {

enum class Kind { kBinary, kLogOdds };
inline constexpr int kDepth = 16;
inline constexpr std::int64_t kKeyOffset = 1 << (kDepth - 1);  ///< key of the cell that begins at 0
inline constexpr double kMinProbability = 0.1192, kMaxProbability = 0.971;
inline constexpr unsigned kFreeLeaf = 1, kOccupiedLeaf = 2, kInner = 3;

/// By the path's extension.
Result<Kind> kind_of(const std::filesystem::path& path);
std::string_view first_line(Kind kind);

/// A cell's key as one number, in the order of the nodes: its bits, highest first, are places of children.
constexpr std::uint64_t code_of(const std::array<std::int64_t, 3>& key) {
  std::uint64_t code = 0;
  for (int bit = kDepth - 1; bit >= 0; --bit)
    for (std::size_t axis = 3; axis-- > 0;)
      code = code << 1 | (static_cast<std::uint64_t>(key[axis]) >> bit & 1u);
  return code;
}

}  // namespace hm::octree
