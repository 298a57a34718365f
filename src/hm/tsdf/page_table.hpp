#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "hm/tsdf/volume.hpp"

namespace hm {

/// A page is 4 x 4 x 4 volumes: the unit that is hashed.
inline constexpr int kPageSide = 4;
inline constexpr int kPageVolumes = kPageSide * kPageSide * kPageSide;

/// The volumes of one page: bit i of `occupied` tells whether volumes[i] exists; bit i of `interior`
/// whether it may hold voxels on or behind a surface.
struct Page {
  VolumeKey key;  ///< page coordinates: volume key / 4, rounded down
  std::uint64_t occupied = 0;
  std::uint64_t interior = 0;
  std::array<Volume, kPageVolumes> volumes;
};

/// The page of a volume, and its place there.
constexpr VolumeKey page_of(VolumeKey key) { return {key.x >> 2, key.y >> 2, key.z >> 2}; }
constexpr unsigned place_in_page(VolumeKey key) {
  return static_cast<unsigned>(((key.z & 3) << 4) | ((key.y & 3) << 2) | (key.x & 3));
}

/// The volume at a place of a page.
constexpr VolumeKey key_in_page(VolumeKey page_key, int place) {
  return {page_key.x * kPageSide + (place & 3), page_key.y * kPageSide + (place >> 2 & 3),
          page_key.z * kPageSide + (place >> 4)};
}

/// Hash map from page key to page: open addressing with linear probing over 64-bit packed keys
/// (21 bits an axis). Pages do not move while the table grows.
class PageTable {
 public:
  PageTable();
  [[nodiscard]] Page* find(VolumeKey page_key) const;
  Page& find_or_add(VolumeKey page_key);
  void remove(VolumeKey page_key);
  [[nodiscard]] std::size_t size() const { return count_; }
  [[nodiscard]] std::size_t bytes() const;
  /// All pages, in no particular order.
  [[nodiscard]] std::vector<Page*> unsorted_pages() const;

  /// True when a page key fits into the packed form.
  static bool is_representable(VolumeKey page_key);

 private:
  struct Slot {
    std::uint64_t packed_key = kEmpty;
    std::unique_ptr<Page> page;
  };
  static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};
  static std::uint64_t pack(VolumeKey key);
  [[nodiscard]] std::size_t slot_of(std::uint64_t packed_key) const;
  void grow();

  std::vector<Slot> slots_;
  std::size_t count_ = 0;
};

}  // namespace hm
