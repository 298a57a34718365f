#pragma once
#include <mutex>
#include <vector>

#include "hm/tsdf/grid/block_pool.hpp"
#include "hm/tsdf/grid/page_table.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {

/// Internal to tsdf/: what a VolumeGrid holds.
struct VolumeGrid::Impl {
  PageTable pages;
  BlockPool pool;
  std::size_t volume_count = 0;
  std::size_t max_bytes = 0;

  // Packed volumes. Readers on several threads may unpack: one at a time.
  std::mutex unpacking;
  std::size_t packed_bytes = 0;   ///< contents, and the pages' arrays for them
  std::size_t packed_planes = 0;  ///< blocks that they would take
  std::size_t next_slot = 0;      ///< where pack_idle() goes on
  std::uint32_t pack_calls = 0;

  std::vector<PageSnapshot> snapshot;
  std::size_t next_in_snapshot = 0;

  [[nodiscard]] std::size_t unpacked_bytes() const {
    return (pool.blocks_in_use() + packed_planes) * BlockPool::kBlockBytes + pages.bytes();
  }
  [[nodiscard]] bool may_take_block(std::size_t bytes_besides = 0) const {
    return max_bytes == 0 || unpacked_bytes() + BlockPool::kBlockBytes + bytes_besides <= max_bytes;
  }

  /// The volume, unpacked if need be; any number of threads.
  Volume* find(VolumeKey key, Page*& page);
  void unpack(Page& page, unsigned place);
  /// Gives the voxels back and keeps them packed.
  void pack(Page& page, unsigned place);
  void drop_packed(Page& page, unsigned place);
  void remove_page(Page& page);
  /// Puts a volume that is about to change into the snapshot, if it is still wanted there.
  void keep_for_snapshot(Page& page, unsigned place) {
    if (page.awaited >> place & 1u) add_to_snapshot(page, place);
  }
  void add_to_snapshot(Page& page, unsigned place);
};

}  // namespace hm
