#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "hm/mvog/column_runs.hpp"
#include "hm/mvog/tile_store.hpp"

namespace hm::mvog {

/// A point in map units: x and y in columns, z in levels.
using CellPoint = Eigen::Vector3d;

/// Turns the beams of one scan into what it says of each column (2.5.2, Fig. 2.16).
///
/// A beam misses the levels whose middle it crosses in a column, or the one that it leaves the column in
/// where it crosses none. Within a cell of the height of its end, a beam that is not level may be glancing
/// along the surface that it ends on, and such beams would erase floors: where it crosses no middle there, it
/// only brushes the level, but in scans that are told to count it. A beam hits a stretch of two levels (one
/// cell) around its end, and ends beside the columns that lie within a quarter of a cell. In the column of
/// its end a beam flatter than 45 degrees misses nothing. The scan's strongest saying counts for each place.
class BeamRaster {
 public:
  /// Forgets the tiles of the scan before. All its sayings must have been taken.
  void clear();
  /// From here on glancing beams count as all others do.
  void count_glancing(bool count) { count_glancing_ = count; }
  void add_return(const CellPoint& origin, const CellPoint& end);
  void add_no_return(const CellPoint& origin, const CellPoint& end);

  static constexpr std::uint32_t kNone = 0xffffffffu;
  /// What the scan says of 64 levels of one column; bit i is level 64 * word + i.
  struct Word {
    std::uint64_t brush = 0, hit = 0, miss = 0, near_hit = 0;
  };
  /// 64 levels of a tile. Its words are zero but for the columns seen.
  struct Layer {
    std::array<Word, kTileColumns> columns{};
    std::uint64_t seen = 0;  ///< bit by place in the tile
    TileKey key;
    std::int32_t word = 0;
    std::uint32_t above = kNone;  ///< the tile's next layer, words increase
  };
  /// A tile that the scan has seen.
  struct ScanTile {
    TileKey key;
    std::uint32_t lowest = kNone;  ///< layer
  };

  [[nodiscard]] std::span<const ScanTile> tiles() const { return tiles_; }
  /// The columns of a tile that the scan has seen, a bit each by place.
  [[nodiscard]] std::uint64_t columns_seen(const ScanTile& tile) const;
  /// What the scan says of one of them. Takes it out of the raster.
  void take_sayings(const ScanTile& tile, std::size_t place, std::vector<SayingStart>& out);
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Walk;
  struct Height;
  enum class BeamEnd { kFlatReturn, kSteepReturn, kNothing };
  void walk(const CellPoint& origin, const CellPoint& end, BeamEnd kind);
  template <bool kRises>
  void walk_in_layer(Walk& walk, Layer& here, std::uint32_t base);
  void mark_levels(const Walk& walk, const Height& to);
  void mark_end(int x, int y, int low_level, std::uint64_t Word::*plane);
  std::uint32_t find_or_add_layer(TileKey key, int word);
  /// The layer of a tile at a word, made when it is not there.
  Layer& layer(TileKey key, int word);

  bool count_glancing_ = true;
  TileIndex index_;  ///< of tiles_
  std::vector<ScanTile> tiles_;
  std::vector<Layer> layers_;
  std::size_t layer_count_ = 0;  ///< in use; all others are zero
  std::array<std::uint32_t, 2048>
      lately_{};  ///< layers by the low bits of key and word, to be looked at first
};

}  // namespace hm::mvog
