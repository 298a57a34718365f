#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string_view>

#include "hm/core/result.hpp"

/// OctoMap's file format, shared by reader and writer: a text header, then the nodes depth first; children by
/// index, where bit 0 selects the upper half in x, bit 1 in y, bit 2 in z.
///   .bt  a node is 16 bits, two for each child: nothing, free leaf, occupied leaf, node with children
///   .ot  a node is its log-odds (float) and a byte with one bit per existing child
namespace hm::octree {

enum class Kind { kBinary, kLogOdds };
inline constexpr int kDepth = 16;
inline constexpr std::int64_t kKeyOffset = 1 << (kDepth - 1);  ///< key of the cell that begins at 0
inline constexpr double kMinProbability = 0.1192, kMaxProbability = 0.971;
inline constexpr unsigned kFreeLeaf = 1, kOccupiedLeaf = 2, kInner = 3;

/// Tree kind by the path's extension; error for any other.
Result<Kind> kind_of(const std::filesystem::path& path);
std::string_view first_line(Kind kind);

/// Morton code of a cell's key, in node order: its bits, highest first, are child indices.
constexpr std::uint64_t code_of(const std::array<std::int64_t, 3>& key) {
  std::uint64_t code = 0;
  for (int bit = kDepth - 1; bit >= 0; --bit)
    for (std::size_t axis = 3; axis-- > 0;)
      code = code << 1 | (static_cast<std::uint64_t>(key[axis]) >> bit & 1u);
  return code;
}

}  // namespace hm::octree
