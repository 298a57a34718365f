#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "hm/tsdf/grid/packed_volume.hpp"

namespace hm {

/// A set of volumes, by pages of 4 x 4 x 4: the page's key (volume key / 4, rounded down), and bit
/// ((z & 3) * 4 + (y & 3)) * 4 + (x & 3) for each volume. Sorted by z, y, x.
struct PageOrder {
  bool operator()(VolumeKey a, VolumeKey b) const {
    return std::array{a.z, a.y, a.x} < std::array{b.z, b.y, b.x};
  }
};
using VolumesByPage = std::map<VolumeKey, std::uint64_t, PageOrder>;

constexpr VolumeKey page_of(VolumeKey key) { return {key.x >> 2, key.y >> 2, key.z >> 2}; }
constexpr unsigned place_in_page(VolumeKey key) {
  return static_cast<unsigned>(((key.z & 3) << 4) | ((key.y & 3) << 2) | (key.x & 3));
}
constexpr std::uint64_t place_bit(VolumeKey key) { return std::uint64_t{1} << place_in_page(key); }
constexpr VolumeKey key_at(VolumeKey page, int place) {
  return {4 * page.x + (place & 3), 4 * page.y + (place >> 2 & 3), 4 * page.z + (place >> 4)};
}

/// A volume as it was when a snapshot began.
struct VolumeSnapshot {
  VolumeKey key;
  bool may_hold_interior = false;
  PackedVolume contents;
};

/// The volumes of a snapshot that lie in one page. Those of `wanted` that are not among `volumes` were not in
/// the grid.
struct PageSnapshot {
  VolumeKey page;
  std::uint64_t wanted = 0;
  std::vector<VolumeSnapshot> volumes;  ///< in no particular order
};

}  // namespace hm
