#include "hm/mvog/tile_pool.hpp"

#include <algorithm>
#include <cstring>

#include "hm/core/check.hpp"

namespace hm::mvog {
namespace {
std::size_t steps_for(std::size_t units) { return (units + TilePool::kStepUnits - 1) / TilePool::kStepUnits; }
}  // namespace

/// Smallest class with a free block that is at most an eighth (or one step) too large; kClasses: none.
std::size_t TilePool::class_to_use(std::size_t wanted) const {
  const std::size_t last = std::min(kClasses - 1, wanted + std::max<std::size_t>(1, wanted / 8));
  for (std::size_t c = wanted; c <= last; ++c)
    if (free_[c]) return c;
  return kClasses;
}

TilePool::Block TilePool::take(std::size_t units) {
  const std::size_t wanted = steps_for(units);
  const std::size_t size = wanted * kStepUnits;
  if (size > kMaxPooledUnits) {
    large_.push_back({std::make_unique_for_overwrite<std::uint16_t[]>(size), size});
    held_units_ += size;
    return {large_.back().units.get(), static_cast<std::uint32_t>(size)};
  }
  if (const std::size_t found = class_to_use(wanted); found < kClasses) {
    return {pop_free(found), static_cast<std::uint32_t>(found * kStepUnits)};
  }
  if (slab_used_ + size > kSlabUnits) {
    if (const std::size_t rest = (kSlabUnits - slab_used_) / kStepUnits; rest > 0 && !slabs_.empty())
      push_free(rest, slabs_.back().units.get() + slab_used_);
    slabs_.push_back({std::make_unique_for_overwrite<std::uint16_t[]>(kSlabUnits), kSlabUnits});
    held_units_ += kSlabUnits;
    slab_used_ = 0;
  }
  std::uint16_t* block = slabs_.back().units.get() + slab_used_;
  slab_used_ += size;
  return {block, static_cast<std::uint32_t>(size)};
}

void TilePool::give_back(Block block) {
  if (!block.units) return;
  if (block.capacity <= kMaxPooledUnits) {
    push_free(block.capacity / kStepUnits, block.units);
    return;
  }
  const auto slab = std::ranges::find_if(large_, [&](const Slab& s) { return s.units.get() == block.units; });
  HM_CHECK(slab != large_.end(), "a block that is not of this pool");
  held_units_ -= slab->size;
  std::swap(*slab, large_.back());
  large_.pop_back();
}

std::size_t TilePool::cost(std::size_t units) const {
  const std::size_t wanted = steps_for(units), size = wanted * kStepUnits;
  if (size > kMaxPooledUnits) return size * 2;
  if (class_to_use(wanted) < kClasses || slab_used_ + size <= kSlabUnits) return 0;
  return kSlabUnits * 2;
}

std::size_t TilePool::bytes() const {
  return held_units_ * sizeof(std::uint16_t) + (slabs_.capacity() + large_.capacity()) * sizeof(Slab);
}

void TilePool::push_free(std::size_t at, std::uint16_t* block) {
  std::memcpy(block, &free_[at], sizeof block);
  free_[at] = block;
}

std::uint16_t* TilePool::pop_free(std::size_t at) {
  std::uint16_t* block = free_[at];
  std::memcpy(&free_[at], block, sizeof block);
  return block;
}

}  // namespace hm::mvog
