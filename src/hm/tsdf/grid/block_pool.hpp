#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace hm {

/// Pool of fixed-size memory blocks in large slabs; blocks are aligned to 64 bytes and zeroed when taken.
/// Slabs are freed only with the pool; returned blocks are reused first.
class BlockPool {
 public:
  static constexpr std::size_t kBlockBytes = 2048;  ///< one plane of a volume: 512 voxels of 4 bytes
  static constexpr std::size_t kSlabBytes = 1u << 20u;

  BlockPool() = default;
  ~BlockPool();
  BlockPool(const BlockPool&) = delete;
  BlockPool& operator=(const BlockPool&) = delete;

  /// Returns a zeroed block. Throws std::bad_alloc when the system is out of memory.
  void* take();
  /// Returns a block to the pool; `dirty` if it may contain non-zero bytes.
  void give_back(void* block, bool dirty);

  [[nodiscard]] std::size_t blocks_in_use() const { return in_use_; }

 private:
  void add_slab();
  std::vector<void*> slabs_;
  std::vector<void*> free_;
  std::size_t in_use_ = 0;
};

}  // namespace hm
