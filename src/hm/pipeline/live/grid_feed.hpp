#pragma once
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "hm/geometry/se2.hpp"
#include "hm/mvog/multi_volume_grid.hpp"
#include "hm/pipeline/live/newest_jobs.hpp"
#include "hm/station/live_store.hpp"

namespace hm {

/// Puts the slice of an occupancy grid into a store, by square tiles; only what changed is looked at. Where
/// the grid lies turned or shifted in `map`, the tiles are sampled at its nearest cells, on another thread.
class GridFeed {
 public:
  static constexpr int kSide = 64;  ///< cells of a tile

  explicit GridFeed(LiveStore& store) : store_(store) {}
  struct Heights {
    double bottom_m = 0, top_m = 0;
  };
  /// Copies the changed squares and returns. Another grid than before, or other heights: all of it.
  void give(const MultiVolumeGrid& grid, const SE2& T_map_grid, const Heights& heights, Time stamp);
  /// The grid that comes next is another one, wherever it lies in memory.
  void forget() { grid_ = nullptr; }
  void wait() { jobs_.wait(); }

 private:
  using Key = std::pair<std::int32_t, std::int32_t>;
  using Cells = std::vector<std::uint8_t>;  ///< kSide * kSide, as the frame has them

  void put_changed(std::map<Key, Cells> changed, const SE2& T_map_grid, double cell_m, double height_m,
                   Time stamp, bool is_new);
  [[nodiscard]] std::vector<Key> touched_by(const std::map<Key, Cells>& squares, double cell_m) const;
  [[nodiscard]] Cells sampled(Key tile, double cell_m) const;
  void put_tile(Key tile, Cells cells, double cell_m, double height_m, Time stamp);

  LiveStore& store_;
  // Of the producer's thread.
  const MultiVolumeGrid* grid_ = nullptr;
  std::uint64_t revision_ = 0;
  Heights heights_;
  // Of the other thread.
  std::map<Key, Cells> squares_;  ///< of the grid, in its frame
  std::map<Key, std::uint32_t> versions_;
  std::map<Key, Cells> tiles_;  ///< as they were put
  SE2 T_map_grid_;
  std::map<Key, Cells> pending_;  ///< copied, not yet taken by the other thread
  std::mutex pending_mutex_;
  bool pending_is_new_ = false;
  NewestJobs<> jobs_;
};

}  // namespace hm
