#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace hm {

/// Fixed-size blocks of memory in large slabs, each block aligned to 64 bytes and all zero when handed
/// out. A slab is never given back to the system before the pool ends; a block given back is used again
/// first.
class BlockPool {
 public:
  static constexpr std::size_t kBlockBytes = 2048;  ///< one plane of a volume: 512 voxels of 4 bytes
  static constexpr std::size_t kSlabBytes = 1u << 20u;

  BlockPool() = default;
  ~BlockPool();
  BlockPool(const BlockPool&) = delete;
  BlockPool& operator=(const BlockPool&) = delete;

  /// A zeroed block. Throws std::bad_alloc when the system has no memory left.
  void* take();
  /// Takes a block back. `dirty` says that it is not all zero.
  void give_back(void* block, bool dirty);

  [[nodiscard]] std::size_t blocks_in_use() const { return in_use_; }

 private:
  void add_slab();
  std::vector<void*> slabs_;
  std::vector<void*> free_;
  std::size_t in_use_ = 0;
};

}  // namespace hm
