#include "hm/mvog/tile_store.hpp"

#include <algorithm>
#include <bit>

namespace hm::mvog {
namespace {
constexpr std::size_t kFirstSlots = 64;
}

TileIndex::TileIndex()
    : slots_(kFirstSlots),
      mask_(kFirstSlots - 1),
      shift_(static_cast<unsigned>(64 - std::bit_width(kFirstSlots - 1))) {}

std::uint32_t TileIndex::find_or_add(TileKey key, std::uint32_t number) {
  if (4 * (count_ + 1) > 3 * slots_.size()) grow();
  std::size_t slot = slot_of(key);
  while (slots_[slot].number != kNone && slots_[slot].key != key) slot = (slot + 1) & mask_;
  if (slots_[slot].number == kNone) {
    slots_[slot] = {key, number};
    ++count_;
  }
  return slots_[slot].number;
}

void TileIndex::grow() {
  std::vector<Slot> old(slots_.size() * 2);
  old.swap(slots_);
  mask_ = slots_.size() - 1;
  shift_ = static_cast<unsigned>(64 - std::bit_width(mask_));
  for (const Slot& from : old) {
    if (from.number == kNone) continue;
    std::size_t slot = slot_of(from.key);
    while (slots_[slot].number != kNone) slot = (slot + 1) & mask_;
    slots_[slot] = from;
  }
}

void TileIndex::clear() {
  if (count_ == 0) return;
  std::ranges::fill(slots_, Slot{});
  count_ = 0;
}

/// Bytes that one more tile adds to the lists of tiles.
std::size_t TileStore::cost_of_tile() const {
  return (tiles_.size() == tiles_.capacity() ? std::max<std::size_t>(1, tiles_.capacity()) * sizeof(Tile)
                                             : 0) +
         index_.cost_of_one();
}

bool TileStore::write(TileKey key, std::span<const std::uint16_t> units, std::uint64_t revision,
                      std::size_t max_bytes) {
  std::uint32_t number = index_.find(key);
  const bool added = number == TileIndex::kNone;
  if (added || tiles_[number].block.capacity < units.size()) {
    // Allocates more than requested, so that a growing tile does not leave many blocks too small for reuse.
    const std::size_t wanted = units.size() + (added ? 0 : units.size() / 5);
    if (bytes() + pool_.cost(wanted) + (added ? cost_of_tile() : 0) > max_bytes) return false;
    const TilePool::Block block = pool_.take(wanted);
    if (added) {
      number = index_.find_or_add(key, static_cast<std::uint32_t>(tiles_.size()));
      tiles_.emplace_back().key = key;
    } else {
      pool_.give_back(tiles_[number].block);
    }
    tiles_[number].block = block;
  }
  std::ranges::copy(units, tiles_[number].block.units);
  tiles_[number].revision = revision;
  move_to_front(number);
  return true;
}

void TileStore::move_to_front(std::uint32_t number) {
  if (number == latest_) return;
  Tile& tile = tiles_[number];
  if (tile.newer != TileIndex::kNone) tiles_[tile.newer].older = tile.older;
  if (tile.older != TileIndex::kNone) tiles_[tile.older].newer = tile.newer;
  tile.newer = TileIndex::kNone;
  tile.older = latest_;
  if (latest_ != TileIndex::kNone) tiles_[latest_].newer = number;
  latest_ = number;
}

std::vector<const Tile*> TileStore::sorted() const {
  std::vector<const Tile*> all;
  all.reserve(tiles_.size());
  for (const Tile& tile : tiles_) all.push_back(&tile);
  std::ranges::sort(all, [](const Tile* a, const Tile* b) {
    return a->key.y != b->key.y ? a->key.y < b->key.y : a->key.x < b->key.x;
  });
  return all;
}

}  // namespace hm::mvog
