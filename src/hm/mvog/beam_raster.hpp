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
/// A beam misses the levels whose middle it crosses in a column, and brushes every other level that it
/// touches. It hits a stretch of two levels (one cell) around its end, and in the columns that lie within a
/// quarter of a cell of its end it is near. In the column of its end a beam flatter than 45 degrees misses
/// nothing. The scan's strongest saying counts for each place.
class BeamRaster {
 public:
  /// Forgets the scan before.
  void clear();
  void add_return(const CellPoint& origin, const CellPoint& end);
  void add_no_return(const CellPoint& origin, const CellPoint& end);

  /// 64 levels of one column; bit i is level 64 * word + i.
  struct Chunk {
    std::uint64_t hit = 0, miss = 0, near_hit = 0, touch = 0;
    std::int32_t word = 0;
    std::uint32_t next = kNoChunk;  ///< of the same column, in no particular order
  };
  /// A tile with what the scan says of its columns.
  struct ScanTile {
    TileKey key;
    std::array<std::uint32_t, kTileColumns> first;  ///< chunk of each column, kNoChunk: not seen
  };
  static constexpr std::uint32_t kNoChunk = 0xffffffffu;

  [[nodiscard]] std::span<const ScanTile> tiles() const { return {tiles_.data(), tile_count_}; }
  /// What the scan says of a column, from its first chunk.
  void sayings(std::uint32_t first_chunk, std::vector<SayingStart>& out);
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Walk;
  void walk(const CellPoint& origin, const CellPoint& end, bool stop_before_end);
  ScanTile& tile(TileKey key);
  Chunk& chunk(ScanTile& tile, std::size_t place, int word);
  void mark_near(int x, int y, int low_level);

  TileIndex index_;
  std::vector<ScanTile> tiles_;
  std::size_t tile_count_ = 0;
  std::vector<Chunk> chunks_;
  std::vector<Chunk> column_;  ///< scratch of sayings()
};

}  // namespace hm::mvog
