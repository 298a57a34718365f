#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "hm/mvog/column_runs.hpp"
#include "hm/mvog/tile_store.hpp"

namespace hm::mvog {

/// Side of a patch of 32 x 32 columns (4 x 4 tiles), which beams seldom leave.
inline constexpr int kPatchSide = 32, kPatchTiles = 16;

/// Index of the observations of 64 levels of a patch.
struct ScanLayer {
  /// Row stride: a row of columns is followed by as many unused entries, so that leaving the patch is visible
  /// in the index.
  static constexpr int kRow = 2 * kPatchSide;
  static constexpr unsigned kOutside = kPatchSide | kPatchSide * kRow;
  static constexpr unsigned place(int x, int y) {
    return static_cast<unsigned>((y & (kPatchSide - 1)) * kRow + (x & (kPatchSide - 1)));
  }
  static std::size_t tile_at(unsigned place) { return (place >> 7 & 12u) | (place >> 3 & 3u); }
  static unsigned place_in_tile(unsigned place) { return (place >> 3 & 56u) | (place & 7u); }

  std::array<std::uint32_t, std::size_t{kRow} * kPatchSide>
      word_at{};                                  ///< index of the word by place; 0: none
  std::array<std::uint64_t, kPatchTiles> seen{};  ///< places with a word, by tile, one bit per place
  TileKey patch;
  int number = 0;
  ScanLayer* above = nullptr;  ///< next layer of the patch, in increasing order
};

/// Observations of columns by a scan. The words are stored in the order of first use, since a planar scan
/// observes few columns of each patch.
class ScanLayers {
 public:
  /// Patch observed by the scan.
  struct Patch {
    TileKey key;  ///< column / 32, rounded down
    ScanLayer* lowest = nullptr;
  };
  static TileKey patch_of(int x, int y) { return {x >> 5, y >> 5}; }

  ScanLayers() : words_(1024) {}
  /// Removes all patches; all observations must have been taken. Layers are counted from level `bottom`.
  void begin(int bottom);
  /// Layer of a patch, created if missing. The reference is valid until begin().
  ScanLayer& at(TileKey patch, int number) {
    ScanLayer*& lately =
        lately_[static_cast<std::size_t>((patch.y & 7) << 5 | (patch.x & 7) << 2 | (number & 3))];
    if (!lately || lately->patch != patch || lately->number != number) [[unlikely]]
      lately = find_or_add(patch, number);
    return *lately;
  }
  /// Observations of a column in a layer, created if missing. The reference is valid until the next word is
  /// created.
  ObservationWord& word(ScanLayer& layer, unsigned place) {
    const std::uint32_t at = layer.word_at[place];
    return words_[at != 0 ? at : add_word(layer, place)];
  }

  [[nodiscard]] std::span<const Patch> patches() const { return patches_; }
  /// Key of a tile of a patch.
  static TileKey tile_key(const Patch& patch, std::size_t tile) {
    return {patch.key.x * 4 + static_cast<int>(tile & 3u), patch.key.y * 4 + static_cast<int>(tile >> 2)};
  }
  /// Observed columns of a tile of a patch, one bit per place in the tile.
  static std::uint64_t columns_seen(const Patch& patch, std::size_t tile);
  /// Returns and removes the observations of one column, ascending; valid until the next call.
  std::span<const ObservationWord> take(const Patch& patch, std::size_t tile, unsigned place_in_tile);
  [[nodiscard]] std::size_t bytes() const;

 private:
  ScanLayer* find_or_add(TileKey patch, int number);
  std::uint32_t add_word(ScanLayer& layer, unsigned place);

  int bottom_ = 0;
  TileIndex index_;  ///< of patches_
  std::vector<Patch> patches_;
  std::vector<std::unique_ptr<ScanLayer>> layers_;
  std::size_t layer_count_ = 0;         ///< in use; all others are empty
  std::vector<ObservationWord> words_;  ///< the first one is not used
  std::size_t word_count_ = 1;          ///< in use
  std::array<ScanLayer*, 256> lately_{};
  std::vector<ObservationWord> taken_;
};

}  // namespace hm::mvog
