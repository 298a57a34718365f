#include "hm/tsdf/grid/block_pool.hpp"

#include <sys/mman.h>

#include <algorithm>
#include <cstring>
#include <new>

namespace hm {

BlockPool::~BlockPool() {
  for (void* slab : slabs_) munmap(slab, kSlabBytes);
}

void BlockPool::add_slab() {
  // Reserves first, so that no slab is leaked; grows by doubling.
  if (slabs_.size() == slabs_.capacity()) slabs_.reserve(2 * slabs_.size() + 16);
  const std::size_t blocks = free_.size() + kSlabBytes / kBlockBytes;
  if (blocks > free_.capacity()) free_.reserve(std::max(blocks, 2 * free_.capacity()));
  void* slab = mmap(nullptr, kSlabBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (slab == MAP_FAILED) throw std::bad_alloc();
  slabs_.push_back(slab);
  // Pushed in reverse, so that blocks are taken by increasing address.
  for (std::size_t offset = kSlabBytes; offset > 0; offset -= kBlockBytes)
    free_.push_back(static_cast<std::byte*>(slab) + (offset - kBlockBytes));
}

void* BlockPool::take() {
  if (free_.empty()) add_slab();
  void* block = free_.back();
  free_.pop_back();
  ++in_use_;
  return block;
}

void BlockPool::give_back(void* block, bool dirty) {
  if (dirty) std::memset(block, 0, kBlockBytes);
  free_.push_back(block);
  --in_use_;
}

}  // namespace hm
