#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "hm/tsdf/grid/packed_volume.hpp"

namespace hm {

/// Order of page keys: by z, y, x. A set of volumes (VolumesByPage) maps the key of a page of 4 x 4 x 4
/// volumes (volume key / 4, rounded down) to a mask with bit ((z & 3) * 4 + (y & 3)) * 4 + (x & 3) for each
/// volume.
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

/// Volume at the time when a snapshot started.
struct VolumeSnapshot {
  VolumeKey key;
  bool may_hold_interior = false;
  PackedVolume contents;
};

/// Volumes of a snapshot in one page. Volumes of `wanted` missing in `volumes` did not exist in the grid.
struct PageSnapshot {
  VolumeKey page;
  std::uint64_t wanted = 0;
  std::vector<VolumeSnapshot> volumes;  ///< in no particular order
};

}  // namespace hm
