#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "hm/mvog/column_runs.hpp"
#include "hm/mvog/tile_store.hpp"

namespace hm::mvog {

/// A patch is 32 x 32 columns, 4 x 4 tiles: beams seldom leave it.
inline constexpr int kPatchSide = 32, kPatchTiles = 16;

/// 64 levels of a patch: where to find what is said of its columns.
struct ScanLayer {
  /// A row of columns is followed by as many unused places, so that leaving the patch shows in the place.
  static constexpr int kRow = 2 * kPatchSide;
  static constexpr unsigned kOutside = kPatchSide | kPatchSide * kRow;
  static constexpr unsigned place(int x, int y) {
    return static_cast<unsigned>((y & (kPatchSide - 1)) * kRow + (x & (kPatchSide - 1)));
  }
  static std::size_t tile_at(unsigned place) { return (place >> 7 & 12u) | (place >> 3 & 3u); }
  static unsigned place_in_tile(unsigned place) { return (place >> 3 & 56u) | (place & 7u); }

  std::array<std::uint32_t, std::size_t{kRow} * kPatchSide> word_at{};  ///< by place; 0: nothing said
  std::array<std::uint64_t, kPatchTiles> seen{};  ///< the others, by tile, a bit by place in the tile
  TileKey patch;
  int number = 0;
  ScanLayer* above = nullptr;  ///< the patch's next one, numbers increase
};

/// What a scan says of the columns that it sees. The words lie side by side in the order in which they were
/// first seen: a scan of a plane sees few of the columns of its patches.
class ScanLayers {
 public:
  /// A patch that the scan has seen.
  struct Patch {
    TileKey key;  ///< column / 32, rounded down
    ScanLayer* lowest = nullptr;
  };
  static TileKey patch_of(int x, int y) { return {x >> 5, y >> 5}; }

  ScanLayers() : words_(1024) {}
  /// Forgets the patches. Everything must have been taken. Layers count from level `bottom`.
  void begin(int bottom);
  /// A patch's layer, made when it is not there. Stays where it is until begin().
  ScanLayer& at(TileKey patch, int number) {
    ScanLayer*& lately =
        lately_[static_cast<std::size_t>((patch.y & 7) << 5 | (patch.x & 7) << 2 | (number & 3))];
    if (!lately || lately->patch != patch || lately->number != number) [[unlikely]]
      lately = find_or_add(patch, number);
    return *lately;
  }
  /// What is said of a column there, made when it is not there. Stays where it is until more is made.
  SaidWord& word(ScanLayer& layer, unsigned place) {
    const std::uint32_t at = layer.word_at[place];
    return words_[at != 0 ? at : add_word(layer, place)];
  }

  [[nodiscard]] std::span<const Patch> patches() const { return patches_; }
  /// The key of a patch's tile, and its columns that were seen, a bit each by place.
  static TileKey tile_key(const Patch& patch, std::size_t tile) {
    return {patch.key.x * 4 + static_cast<int>(tile & 3u), patch.key.y * 4 + static_cast<int>(tile >> 2)};
  }
  static std::uint64_t columns_seen(const Patch& patch, std::size_t tile);
  /// What the scan says of one of them, upwards. Takes it out; valid until the next call.
  std::span<const SaidWord> take(const Patch& patch, std::size_t tile, unsigned place_in_tile);
  [[nodiscard]] std::size_t bytes() const;

 private:
  ScanLayer* find_or_add(TileKey patch, int number);
  std::uint32_t add_word(ScanLayer& layer, unsigned place);

  int bottom_ = 0;
  TileIndex index_;  ///< of patches_
  std::vector<Patch> patches_;
  std::vector<std::unique_ptr<ScanLayer>> layers_;
  std::size_t layer_count_ = 0;  ///< in use; all others say nothing
  std::vector<SaidWord> words_;  ///< the first one is not used
  std::size_t word_count_ = 1;   ///< in use
  std::array<ScanLayer*, 256> lately_{};
  std::vector<SaidWord> taken_;
};

}  // namespace hm::mvog
