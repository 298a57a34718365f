#pragma once
#include <mutex>
#include <vector>

#include "hm/tsdf/grid/block_pool.hpp"
#include "hm/tsdf/grid/page_table.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {

/// Implementation of VolumeGrid; internal to tsdf/.
struct VolumeGrid::Impl {
  PageTable pages;
  BlockPool pool;
  std::size_t volume_count = 0;
  std::size_t max_bytes = 0;
  std::size_t refused = 0;

  // Packed volumes. Several reader threads may unpack; the mutex serialises them.
  std::mutex unpacking;
  std::size_t packed_bytes = 0;   ///< contents, and the arrays of the pages for them
  std::size_t packed_planes = 0;  ///< number of blocks if unpacked
  std::size_t next_slot = 0;      ///< where pack_idle() continues
  std::uint32_t pack_calls = 0;

  std::vector<PageSnapshot> snapshot;
  std::size_t next_in_snapshot = 0;

  [[nodiscard]] std::size_t unpacked_bytes() const {
    return (pool.blocks_in_use() + packed_planes) * BlockPool::kBlockBytes + pages.bytes();
  }
  [[nodiscard]] bool may_take_block(std::size_t bytes_besides = 0) const {
    return max_bytes == 0 || unpacked_bytes() + BlockPool::kBlockBytes + bytes_besides <= max_bytes;
  }

  /// Finds the volume and unpacks it if necessary; thread safe.
  Volume* find(VolumeKey key, Page*& page);
  void unpack(Page& page, unsigned place);
  /// Packs the volume and releases its voxels.
  void pack(Page& page, unsigned place);
  void drop_packed(Page& page, unsigned place);
  void remove_page(Page& page);
  /// Adds a volume that is about to change to the snapshot, if it is still needed there.
  void keep_for_snapshot(Page& page, unsigned place) {
    if (page.awaited >> place & 1u) add_to_snapshot(page, place);
  }
  void add_to_snapshot(Page& page, unsigned place);
};

}  // namespace hm
