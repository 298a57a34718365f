#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "hm/mvog/column_runs.hpp"
#include "hm/mvog/tile_pool.hpp"

namespace hm::mvog {

/// Side of a tile of 8 x 8 columns, the unit of hashing, storage (one block) and change reports.
inline constexpr int kTileSide = 8, kTileColumns = kTileSide * kTileSide;
/// Number of offsets at the start of a block: the start of each column and the end of the last one.
inline constexpr std::size_t kOffsets = kTileColumns + 1;

struct TileKey {
  std::int32_t x = 0, y = 0;  ///< column / 8, rounded down
  bool operator==(const TileKey&) const = default;
};
/// Tile of a column, and its index in the tile.
constexpr TileKey tile_of(int x, int y) { return {x >> 3, y >> 3}; }
constexpr std::size_t place_in_tile(int x, int y) { return static_cast<std::size_t>((y & 7) * 8 + (x & 7)); }

/// Hash map from tile key to number: open addressing, linear probing.
class TileIndex {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  TileIndex();
  [[nodiscard]] std::uint32_t find(TileKey key) const {
    for (std::size_t slot = slot_of(key);; slot = (slot + 1) & mask_) {
      if (slots_[slot].number == kNone || slots_[slot].key == key) return slots_[slot].number;
    }
  }
  /// Number of a key; a new key is added with `number`.
  std::uint32_t find_or_add(TileKey key, std::uint32_t number);
  /// Removes all keys; the cost is proportional to their number.
  void clear();
  /// Bytes that one more key would add to bytes().
  [[nodiscard]] std::size_t cost_of_one() const { return 4 * (count_ + 1) > 3 * slots_.size() ? bytes() : 0; }
  [[nodiscard]] std::size_t bytes() const { return slots_.capacity() * sizeof(Slot); }

 private:
  struct Slot {
    TileKey key;
    std::uint32_t number = kNone;
  };
  [[nodiscard]] std::size_t slot_of(TileKey key) const {
    const std::uint64_t packed = static_cast<std::uint64_t>(static_cast<std::uint32_t>(key.x)) << 32 |
                                 static_cast<std::uint32_t>(key.y);
    return static_cast<std::size_t>(packed * 0x9e3779b97f4a7c15u >> shift_);
  }
  void grow();
  std::vector<Slot> slots_;
  std::size_t mask_ = 0, count_ = 0;
  unsigned shift_ = 0;
};

struct Tile {
  TileKey key;
  TilePool::Block block;       ///< kOffsets offsets (units from the block's start), then the columns
  std::uint64_t revision = 0;  ///< of the last change
  std::uint32_t newer = TileIndex::kNone,
                older = TileIndex::kNone;  ///< neighbours in the order of last changes

  [[nodiscard]] ColumnUnits column(std::size_t place) const {
    return {block.units + block.units[place], block.units + block.units[place + 1]};
  }
  [[nodiscard]] std::span<const std::uint16_t> units() const {
    return {block.units, static_cast<std::size_t>(block.units[kTileColumns])};
  }
};

/// Tiles of a map, linked in the order of their last changes.
class TileStore {
 public:
  [[nodiscard]] const Tile* find(TileKey key) const {
    const std::uint32_t number = index_.find(key);
    return number == TileIndex::kNone ? nullptr : &tiles_[number];
  }
  [[nodiscard]] ColumnUnits column(int x, int y) const {
    const Tile* tile = find(tile_of(x, y));
    return tile ? tile->column(place_in_tile(x, y)) : ColumnUnits{};
  }
  /// Replaces or adds a tile with the whole block `units`. Returns false if this needs more than `max_bytes`.
  bool write(TileKey key, std::span<const std::uint16_t> units, std::uint64_t revision,
             std::size_t max_bytes);

  [[nodiscard]] std::span<const Tile> tiles() const { return tiles_; }
  /// All tiles, sorted by y, then x.
  [[nodiscard]] std::vector<const Tile*> sorted() const;
  /// Tile that changed last; continue with older(). nullptr: none.
  [[nodiscard]] const Tile* latest() const {
    return latest_ == TileIndex::kNone ? nullptr : &tiles_[latest_];
  }
  [[nodiscard]] const Tile* older(const Tile& tile) const {
    return tile.older == TileIndex::kNone ? nullptr : &tiles_[tile.older];
  }
  [[nodiscard]] std::size_t bytes() const {
    return pool_.bytes() + index_.bytes() + tiles_.capacity() * sizeof(Tile);
  }

 private:
  [[nodiscard]] std::size_t cost_of_tile() const;
  void move_to_front(std::uint32_t number);
  TileIndex index_;
  std::vector<Tile> tiles_;
  TilePool pool_;
  std::uint32_t latest_ = TileIndex::kNone;
};

}  // namespace hm::mvog
