#include "hm/mvog/beam_raster.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

namespace hm::mvog {
namespace {

/// Added before rounding towards zero, so that it rounds down; a multiple of 64.
constexpr int kOffset = 1 << 17;
constexpr double kNearColumn = 0.25;
constexpr double kNever = 4;  ///< shares of a beam end at 1

/// floor() for numbers whose distance from 0 is below kOffset.
int floor_level(double level) { return static_cast<int>(level + kOffset) - kOffset; }
int word_of(int level) { return level >> 6; }

/// Bits first to last of a word.
std::uint64_t bits(int first, int last) {
  return (std::uint64_t{2} << (last & 63)) - (std::uint64_t{1} << (first & 63));
}

}  // namespace

void BeamRaster::clear() {
  index_.clear();
  tile_count_ = 0;
  chunks_.clear();
}

std::size_t BeamRaster::bytes() const {
  return index_.bytes() + tiles_.capacity() * sizeof(ScanTile) +
         (chunks_.capacity() + column_.capacity()) * sizeof(Chunk);
}

BeamRaster::ScanTile& BeamRaster::tile(TileKey key) {
  const std::uint32_t number = index_.find_or_add(key, static_cast<std::uint32_t>(tile_count_));
  if (number == tile_count_) {
    if (tile_count_ == tiles_.size()) tiles_.emplace_back();
    tiles_[tile_count_].key = key;
    tiles_[tile_count_].first.fill(kNoChunk);
    ++tile_count_;
  }
  return tiles_[number];
}

BeamRaster::Chunk& BeamRaster::chunk(ScanTile& tile, std::size_t place, int word) {
  const std::uint32_t first = tile.first[place];
  for (std::uint32_t i = first; i != kNoChunk; i = chunks_[i].next)
    if (chunks_[i].word == word) return chunks_[i];
  tile.first[place] = static_cast<std::uint32_t>(chunks_.size());
  Chunk& added = chunks_.emplace_back();
  added.word = word;
  added.next = first;
  return added;
}

void BeamRaster::mark_near(int x, int y, int low_level) {
  for (int level = low_level; level < low_level + 2; ++level)
    chunk(tile(tile_of(x, y)), place_in_tile(x, y), word_of(level)).near_hit |= bits(level, level);
}

void BeamRaster::add_return(const CellPoint& origin, const CellPoint& end) {
  const double rise = std::abs(end.z() - origin.z()) / 2;  // in cells
  const bool steep = rise > std::hypot(end.x() - origin.x(), end.y() - origin.y());
  walk(origin, end, !steep);
  const int x = static_cast<int>(std::floor(end.x())), y = static_cast<int>(std::floor(end.y()));
  const int low = floor_level(end.z() + 0.5) - 1;
  for (int level = low; level < low + 2; ++level)
    chunk(tile(tile_of(x, y)), place_in_tile(x, y), word_of(level)).hit |= bits(level, level);
  const double u = end.x() - x, v = end.y() - y;
  const int dx = u < kNearColumn ? -1 : u > 1 - kNearColumn ? 1 : 0;
  const int dy = v < kNearColumn ? -1 : v > 1 - kNearColumn ? 1 : 0;
  if (dx) mark_near(x + dx, y, low);
  if (dy) mark_near(x, y + dy, low);
  if (dx && dy) mark_near(x + dx, y + dy, low);
}

void BeamRaster::add_no_return(const CellPoint& origin, const CellPoint& end) { walk(origin, end, false); }

void BeamRaster::walk(const CellPoint& origin, const CellPoint& end, bool stop_before_end) {
  int x = static_cast<int>(std::floor(origin.x())), y = static_cast<int>(std::floor(origin.y()));
  const int end_x = static_cast<int>(std::floor(end.x())), end_y = static_cast<int>(std::floor(end.y()));
  const CellPoint d = end - origin;
  const int step_x = d.x() < 0 ? -1 : 1, step_y = d.y() < 0 ? -1 : 1;
  // Walls are crossed at the share t of the beam; when no more are to be crossed in x or y, the next is
  // never.
  int walls_x = std::abs(end_x - x), walls_y = std::abs(end_y - y);
  const double per_x = std::abs(1 / d.x()), per_y = std::abs(1 / d.y());
  double t_x = walls_x ? (x + (step_x > 0) - origin.x()) / d.x() : kNever;
  double t_y = walls_y ? (y + (step_y > 0) - origin.y()) / d.y() : kNever;
  int columns = walls_x + walls_y + (stop_before_end ? 0 : 1);
  TileKey key = tile_of(x, y);
  ScanTile* here = columns > 0 ? &tile(key) : nullptr;
  double z = origin.z();
  int touch = floor_level(z), cross = floor_level(z + 0.5);
  for (; columns > 0; --columns) {
    const double t = std::min({t_x, t_y, 1.0});
    z = origin.z() + d.z() * t;
    const int next_touch = floor_level(z), next_cross = floor_level(z + 0.5);
    const int low = std::min(touch, next_touch), high = std::max(touch, next_touch);
    const int miss_low = std::min(cross, next_cross), miss_high = std::max(cross, next_cross) - 1;
    if (TileKey k = tile_of(x, y); k != key) {
      key = k;
      here = &tile(key);
    }
    for (int word = word_of(low); word <= word_of(high); ++word) {
      Chunk& to = chunk(*here, place_in_tile(x, y), word);
      const int first = word * 64, last = first + 63;
      to.touch |= bits(std::max(low, first), std::min(high, last));
      if (miss_low <= miss_high && miss_low <= last && miss_high >= first)
        to.miss |= bits(std::max(miss_low, first), std::min(miss_high, last));
    }
    touch = next_touch;
    cross = next_cross;
    if (t_x < t_y) {
      x += step_x;
      t_x = --walls_x ? t_x + per_x : kNever;
    } else {
      y += step_y;
      t_y = --walls_y ? t_y + per_y : kNever;
    }
  }
}

void BeamRaster::sayings(std::uint32_t first_chunk, std::vector<SayingStart>& out) {
  column_.clear();
  for (std::uint32_t i = first_chunk; i != kNoChunk; i = chunks_[i].next) column_.push_back(chunks_[i]);
  std::ranges::sort(column_, {}, &Chunk::word);
  out.clear();
  Saying before = Saying::kNothing;
  for (std::size_t i = 0; i < column_.size(); ++i) {
    Chunk& c = column_[i];
    const int base = c.word * 64;
    if (before != Saying::kNothing && column_[i - 1].word + 1 != c.word) {
      out.push_back({(column_[i - 1].word + 1) * 64, Saying::kNothing});
      before = Saying::kNothing;
    }
    c.miss &= ~c.hit;
    c.near_hit &= ~(c.hit | c.miss);
    c.touch &= ~(c.hit | c.miss | c.near_hit);
    const auto edges = [&](std::uint64_t plane, Saying saying) {
      return plane ^ (plane << 1 | (before == saying ? 1u : 0u));
    };
    std::uint64_t starts = edges(c.hit, Saying::kHit) | edges(c.miss, Saying::kMiss) |
                           edges(c.near_hit, Saying::kNearOccupied) | edges(c.touch, Saying::kNearFree);
    for (; starts != 0; starts &= starts - 1) {
      const int bit = std::countr_zero(starts);
      const auto in = [&](std::uint64_t plane) { return plane >> bit & 1u; };
      before = in(c.hit)        ? Saying::kHit
               : in(c.miss)     ? Saying::kMiss
               : in(c.near_hit) ? Saying::kNearOccupied
               : in(c.touch)    ? Saying::kNearFree
                                : Saying::kNothing;
      out.push_back({base + bit, before});
    }
  }
  if (before != Saying::kNothing) out.push_back({(column_.back().word + 1) * 64, Saying::kNothing});
}

}  // namespace hm::mvog
