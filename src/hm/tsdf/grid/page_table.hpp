#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "hm/tsdf/grid/volume_snapshot.hpp"

namespace hm {

/// Side of a page of 4 x 4 x 4 volumes, the unit of hashing (see volume_snapshot.hpp for keys and places).
inline constexpr int kPageSide = 4;
inline constexpr int kPageVolumes = kPageSide * kPageSide * kPageSide;

/// The volumes of one page. Bit i of `occupied`: volumes[i] exists; of `interior`: it may hold voxels on or
/// behind a surface; of `awaited`: the current snapshot still needs it. A volume that exists but has no
/// voxels is in `packed`.
struct Page {
  VolumeKey key;  ///< page coordinates: volume key / 4, rounded down
  std::uint64_t occupied = 0;
  std::uint64_t interior = 0;
  std::uint64_t awaited = 0;
  std::uint32_t snapshot_place = 0;  ///< index of this page in the snapshot
  std::uint32_t last_used = 0;       ///< in calls of VolumeGrid::pack_idle()
  std::array<Volume, kPageVolumes> volumes;
  std::unique_ptr<std::array<PackedVolume, kPageVolumes>> packed;  ///< nullptr until a volume is packed
};

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
  /// The table's slots, for visiting a few pages at a time; nullptr if empty.
  [[nodiscard]] std::size_t slot_count() const { return slots_.size(); }
  [[nodiscard]] Page* page_in_slot(std::size_t slot) const { return slots_[slot].page.get(); }
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
