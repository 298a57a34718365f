#include "hm/pipeline/live/grid_feed.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "hm/station/live_frames.hpp"

namespace hm {
namespace {

/// Percent of a slice -> 0 unknown, 1 free ... 255 occupied.
std::uint8_t cell_byte(std::uint8_t percent) {
  if (percent == OccupancyGrid2D::kUnknown) return 0;
  return static_cast<std::uint8_t>(1 + percent * 254 / 100);
}

int floor_of(double value) { return static_cast<int>(std::floor(value)); }

}  // namespace

void GridFeed::give(const MultiVolumeGrid& grid, const SE2& T_map_grid, const Heights& heights, Time stamp) {
  const bool is_new = &grid != grid_ || grid.revision() < revision_ ||
                      heights.bottom_m != heights_.bottom_m || heights.top_m != heights_.top_m;
  const double cell_m = grid.params().resolution_m, side_m = kSide * cell_m;
  std::set<Key> changed;
  for (const ChangedTile& tile : grid.changed_since(is_new ? 0 : revision_)) {
    const Eigen::Vector2d middle = (tile.min_m + tile.max_m) / 2;
    changed.insert({floor_of(middle.x() / side_m), floor_of(middle.y() / side_m)});
  }
  grid_ = &grid;
  revision_ = grid.revision();
  heights_ = heights;
  {
    const std::lock_guard lock(pending_mutex_);
    if (is_new) pending_.clear();
    pending_is_new_ |= is_new;
    for (const Key& key : changed) {
      const auto slice =
          grid.slice_square({key.first * kSide, key.second * kSide}, kSide, heights.bottom_m, heights.top_m);
      Cells& cells = pending_[key];
      cells.clear();
      for (const std::uint8_t percent : slice.cells.pixels()) cells.push_back(cell_byte(percent));
    }
  }
  const double height_m = std::abs(heights.bottom_m) < 1e3 ? heights.bottom_m : 0;
  jobs_.give(0, [this, T_map_grid, cell_m, height_m, stamp] {
    std::map<Key, Cells> copied;
    bool all = false;
    {
      const std::lock_guard lock(pending_mutex_);
      copied = std::exchange(pending_, {});
      all = std::exchange(pending_is_new_, false);
    }
    put_changed(std::move(copied), T_map_grid, cell_m, height_m, stamp, all);
  });
}

/// Tiles of `map` that these squares of the grid reach into.
std::vector<GridFeed::Key> GridFeed::touched_by(const std::map<Key, Cells>& squares, double cell_m) const {
  std::set<Key> touched;
  const double side_m = kSide * cell_m;
  for (const auto& [key, cells] : squares) {
    const Vec2 middle = T_map_grid_ * Vec2((key.first + 0.5) * side_m, (key.second + 0.5) * side_m);
    const double reach_m =
        0.5 * side_m * (std::abs(T_map_grid_.cosine()) + std::abs(T_map_grid_.sine())) - 1e-6 * side_m;
    for (int y = floor_of((middle.y() - reach_m) / side_m); y <= floor_of((middle.y() + reach_m) / side_m);
         ++y)
      for (int x = floor_of((middle.x() - reach_m) / side_m); x <= floor_of((middle.x() + reach_m) / side_m);
           ++x)
        touched.insert({x, y});
  }
  return {touched.begin(), touched.end()};
}

/// The cells of a tile of `map`, each that of the grid below its centre.
GridFeed::Cells GridFeed::sampled(Key tile, double cell_m) const {
  Cells cells(static_cast<std::size_t>(kSide) * kSide, 0);
  const SE2 T_grid_map = T_map_grid_.inverse();
  const Cells* square = nullptr;
  Key at{INT32_MAX, INT32_MAX};
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const Vec2 p_map((tile.first * kSide + x + 0.5) * cell_m, (tile.second * kSide + y + 0.5) * cell_m);
      const Vec2 p_grid = T_grid_map * p_map;
      const int column = floor_of(p_grid.x() / cell_m), row = floor_of(p_grid.y() / cell_m);
      const Key key{floor_of(static_cast<double>(column) / kSide),
                    floor_of(static_cast<double>(row) / kSide)};
      if (key != at) {
        const auto found = squares_.find(key);
        square = found == squares_.end() ? nullptr : &found->second;
        at = key;
      }
      if (!square) continue;
      const int in_row = row - key.second * kSide, in_column = column - key.first * kSide;
      cells[static_cast<std::size_t>(y * kSide + x)] =
          (*square)[static_cast<std::size_t>(in_row * kSide + in_column)];
    }
  return cells;
}

void GridFeed::put_changed(std::map<Key, Cells> changed, const SE2& T_map_grid, double cell_m,
                           double height_m, Time stamp, bool is_new) {
  constexpr double kSameDistance_m = 1e-3, kSameAngle_rad = 1e-4;
  const Vec3 moved = (T_map_grid_.inverse() * T_map_grid).log();
  const bool has_moved = moved.head<2>().norm() > kSameDistance_m || std::abs(moved.z()) > kSameAngle_rad;
  if (is_new) squares_.clear();
  std::map<Key, Cells> renewed = changed;
  for (auto& [key, cells] : changed) squares_[key] = std::move(cells);
  if (has_moved || is_new) {
    T_map_grid_ = T_map_grid;
    renewed = squares_;
  }
  std::vector<Key> touched = touched_by(renewed, cell_m);
  if (has_moved || is_new)
    for (const auto& [key, cells] : tiles_) touched.push_back(key);  // it may have left them
  for (const Key& tile : touched) put_tile(tile, sampled(tile, cell_m), cell_m, height_m, stamp);
}

void GridFeed::put_tile(Key tile, Cells cells, double cell_m, double height_m, Time stamp) {
  Cells& before = tiles_[tile];
  const bool is_empty = std::all_of(cells.begin(), cells.end(), [](std::uint8_t cell) { return cell == 0; });
  if (before == cells || (before.empty() && is_empty)) return;
  before = cells;
  GridTileFrame frame;
  frame.x = tile.first;
  frame.y = tile.second;
  frame.version = ++versions_[tile];
  frame.cell_m = static_cast<float>(cell_m);
  frame.height_m = static_cast<float>(height_m);
  frame.side = kSide;
  frame.cells = std::move(cells);
  const auto id = static_cast<std::uint64_t>(static_cast<std::uint32_t>(tile.first)) << 32U |
                  static_cast<std::uint32_t>(tile.second);
  store_.put(LiveKind::kGridTile, id, stamp, to_payload(frame));
}

}  // namespace hm
