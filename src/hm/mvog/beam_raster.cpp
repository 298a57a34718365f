#include "hm/mvog/beam_raster.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

namespace hm::mvog {
namespace {

constexpr double kNearColumn = 0.25;
constexpr std::uint32_t kGlancing = 2;  ///< levels above and below the end
constexpr double kLevelBeam = 2;        ///< a level beam climbs less than this, in levels
constexpr double kNever = std::numeric_limits<double>::infinity();
/// Heights are whole numbers of 2^-32 levels above kLowest, so that they are positive.
constexpr int kFractionBits = 32;
constexpr int kLowest = -(1 << 17);
constexpr double kUnitsPerLevel = 4294967296.0;
constexpr std::int64_t kHalfLevel = std::int64_t{1} << (kFractionBits - 1);

double to_units(double level) { return (level - kLowest) * kUnitsPerLevel; }
int word_of(int level) { return level >> 6; }
std::uint64_t bit_of(std::uint32_t level) { return std::uint64_t{1} << (level & 63); }

}  // namespace

/// A height, as levels above kLowest: the one that it is in, and the first one whose middle is not below it;
/// and their bits.
struct BeamRaster::Height {
  std::uint32_t in, next;
  std::uint64_t next_bit;
  std::int64_t units;
  explicit Height(double z) : Height(static_cast<std::int64_t>(z)) {}
  explicit Height(std::int64_t z) : units(z) {
    in = static_cast<std::uint32_t>(z >> kFractionBits);
    next = static_cast<std::uint32_t>((z + kHalfLevel) >> kFractionBits);
    next_bit = bit_of(next);
  }
  /// True when both are among the 64 levels from `base` on, a multiple of 64.
  [[nodiscard]] bool within(std::uint32_t base) const { return ((in ^ base) | (next ^ base)) < 64; }
};
void BeamRaster::clear() {
  index_.clear();
  tiles_.clear();
  layer_count_ = 0;
}

std::size_t BeamRaster::bytes() const {
  return index_.bytes() + tiles_.capacity() * sizeof(ScanTile) + layers_.capacity() * sizeof(Layer);
}

BeamRaster::Layer& BeamRaster::layer(TileKey key, int word) {
  std::uint32_t& lately =
      lately_[static_cast<std::size_t>((key.y & 31) << 6 | (key.x & 31) << 1 | (word & 1))];
  if (lately < layer_count_) {
    Layer& found = layers_[lately];
    if (found.key == key && found.word == word) [[likely]]
      return found;
  }
  lately = find_or_add_layer(key, word);
  return layers_[lately];
}

std::uint32_t BeamRaster::find_or_add_layer(TileKey key, int word) {
  const std::uint32_t number = index_.find_or_add(key, static_cast<std::uint32_t>(tiles_.size()));
  if (number == tiles_.size()) tiles_.push_back({key, kNone});
  ScanTile& of = tiles_[number];
  std::uint32_t below = kNone, at = of.lowest;
  for (; at != kNone && layers_[at].word < word; at = layers_[at].above) below = at;
  if (at != kNone && layers_[at].word == word) return at;
  const auto added = static_cast<std::uint32_t>(layer_count_++);
  if (added == layers_.size()) layers_.emplace_back();
  layers_[added].key = key;
  layers_[added].word = word;
  layers_[added].above = at;
  (below == kNone ? of.lowest : layers_[below].above) = added;
  return added;
}

/// Two levels of a column, in the plane of what the scan says there.
void BeamRaster::mark_end(int x, int y, int low_level, std::uint64_t Word::*plane) {
  const std::size_t place = place_in_tile(x, y);
  Layer& low = layer(tile_of(x, y), word_of(low_level));
  low.columns[place].*plane |= std::uint64_t{3} << (low_level & 63);
  low.seen |= std::uint64_t{1} << place;
  if ((low_level & 63) != 63) return;
  Layer& high = layer(tile_of(x, y), word_of(low_level + 1));
  high.columns[place].*plane |= 1;
  high.seen |= std::uint64_t{1} << place;
}

void BeamRaster::add_return(const CellPoint& origin, const CellPoint& end) {
  const CellPoint d = end - origin;
  const bool steep = d.z() * d.z() > 4 * (d.x() * d.x() + d.y() * d.y());  // a level is half a cell
  walk(origin, end, steep ? BeamEnd::kSteepReturn : BeamEnd::kFlatReturn);
  const int x = static_cast<int>(std::floor(end.x())), y = static_cast<int>(std::floor(end.y()));
  const int low = static_cast<int>(std::floor(end.z() + 0.5)) - 1;
  mark_end(x, y, low, &Word::hit);
  const double u = end.x() - x, v = end.y() - y;
  const int dx = u < kNearColumn ? -1 : u >= 1 - kNearColumn ? 1 : 0;
  const int dy = v < kNearColumn ? -1 : v >= 1 - kNearColumn ? 1 : 0;
  if (dx) mark_end(x + dx, y, low, &Word::near_hit);
  if (dy) mark_end(x, y + dy, low, &Word::near_hit);
  if (dx && dy) mark_end(x + dx, y + dy, low, &Word::near_hit);
}

void BeamRaster::add_no_return(const CellPoint& origin, const CellPoint& end) {
  walk(origin, end, BeamEnd::kNothing);
}

/// A beam on its way over the columns; walls are crossed at the share t of the beam.
struct BeamRaster::Walk {
  TileKey key;
  int place, step_x, step_y, exit_x, exit_y, walls;
  double t_x, t_y, per_x, per_y, z0, dz;
  Height at;  ///< where it came into this column
  std::uint32_t glancing_from = 0,
                glancing_count = 0;  ///< levels in which it misses nothing but by their middle

  Walk(const CellPoint& origin, const CellPoint& end) : at(to_units(origin.z())) {
    const int x = static_cast<int>(std::floor(origin.x())), y = static_cast<int>(std::floor(origin.y()));
    const CellPoint d = end - origin;
    key = tile_of(x, y);
    place = static_cast<int>(place_in_tile(x, y));
    step_x = d.x() < 0 ? -1 : 1;
    step_y = d.y() < 0 ? -8 : 8;
    exit_x = d.x() < 0 ? 0 : 7;
    exit_y = d.y() < 0 ? 0 : 56;
    const int walls_x = std::abs(static_cast<int>(std::floor(end.x())) - x);
    const int walls_y = std::abs(static_cast<int>(std::floor(end.y())) - y);
    walls = walls_x + walls_y;
    const double inverse_x = 1 / d.x(), inverse_y = 1 / d.y();
    per_x = std::abs(inverse_x);
    per_y = std::abs(inverse_y);
    t_x = walls_x ? (x + (step_x > 0) - origin.x()) * inverse_x : kNever;
    t_y = walls_y ? (y + (step_y > 0) - origin.y()) * inverse_y : kNever;
    z0 = to_units(origin.z());
    dz = d.z() * kUnitsPerLevel;
  }
  /// The height at which the beam leaves this column.
  [[nodiscard]] Height leaves() const { return Height(z0 + dz * std::min(t_x, t_y)); }
  [[nodiscard]] bool glances(const Height& h) const { return h.in - glancing_from < glancing_count; }
  /// The levels of the layer from `base` on that count as missed where the beam leaves a column in them.
  [[nodiscard]] std::uint64_t not_glancing(std::uint32_t base) const {
    const int first = static_cast<int>(glancing_from - base), end = first + static_cast<int>(glancing_count);
    if (end <= 0 || first >= 64) return ~std::uint64_t{0};
    const std::uint64_t below_end = end >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << end) - 1;
    return ~(below_end & (first <= 0 ? ~std::uint64_t{0} : ~((std::uint64_t{1} << first) - 1)));
  }
  /// Steps into the next column. Returns whether it is of another tile.
  bool step() {
    --walls;
    if (t_x < t_y) {
      t_x += per_x;
      if ((place & 7) != exit_x) {
        place += step_x;
        return false;
      }
      place ^= 7;
      key.x += step_x;
      return true;
    }
    t_y += per_y;
    if ((place & 56) != exit_y) {
      place += step_y;
      return false;
    }
    place ^= 56;
    key.y += step_y / 8;
    return true;
  }
};

/// The part of a beam in this column up to a height, level by level.
void BeamRaster::mark_levels(const Walk& walk, const Height& to) {
  const bool rises = to.in >= walk.at.in && to.next >= walk.at.next;
  const Height &low = rises ? walk.at : to, &high = rises ? to : walk.at;
  const auto place = static_cast<std::size_t>(walk.place);
  for (std::uint32_t level = low.in; level <= high.in; ++level) {
    Layer& here = layer(walk.key, word_of(static_cast<int>(level) + kLowest));
    const bool crossed = level >= low.next && level < high.next;
    const bool leaves_in = low.next == high.next && level == to.in;
    if (crossed || (leaves_in && !walk.glances(to))) here.columns[place].miss |= bit_of(level);
    if (leaves_in) here.columns[place].brush |= bit_of(level);
    if (!crossed && !leaves_in) continue;
    here.seen |= std::uint64_t{1} << place;
  }
}

/// Walks as long as the beam stays in a tile and a layer of it. This is where the time of a scan goes: a
/// function of its own, so that everything stays in registers.
template <bool kRises>
[[gnu::noinline]] void BeamRaster::walk_in_layer(Walk& w, Layer& here, std::uint32_t base) {
  const double z0 = w.z0 - base * kUnitsPerLevel, dz = w.dz, per_x = w.per_x, per_y = w.per_y;
  const std::uint64_t counts = w.glancing_count == 0 ? ~std::uint64_t{0} : w.not_glancing(base);
  double t_x = w.t_x, t_y = w.t_y;
  std::uint64_t next_bit = w.at.next_bit, seen = 0;
  std::int64_t last = w.at.units - (std::int64_t{base} << kFractionBits);
  int place = w.place, walls = w.walls;
  while (walls > 0) {
    const auto z = static_cast<std::int64_t>(z0 + dz * std::min(t_x, t_y));
    const auto in = static_cast<std::uint64_t>(z >> kFractionBits);
    const auto next = static_cast<std::uint64_t>((z + kHalfLevel) >> kFractionBits);
    if ((in | next) >= 64) break;
    const std::uint64_t to_in = std::uint64_t{1} << in, to_next = std::uint64_t{1} << next;
    const std::uint64_t crossed = kRises ? to_next - next_bit : next_bit - to_next;
    Word& column = here.columns[static_cast<std::size_t>(place)];
    // All ones when no middle was crossed; without a branch, for that cannot be foreseen.
    const std::uint64_t none = ((crossed | (0 - crossed)) >> 63) - 1;
    column.miss |= crossed | (to_in & counts & none);
    column.brush |= to_in & none;
    seen |= std::uint64_t{1} << place;
    next_bit = to_next;
    last = z;
    --walls;
    if (t_x < t_y) {
      t_x += per_x;
      if ((place & 7) == w.exit_x) {
        place ^= 7;
        w.key.x += w.step_x;
        break;
      }
      place += w.step_x;
    } else {
      t_y += per_y;
      if ((place & 56) == w.exit_y) {
        place ^= 56;
        w.key.y += w.step_y / 8;
        break;
      }
      place += w.step_y;
    }
  }
  here.seen |= seen;
  w.t_x = t_x;
  w.t_y = t_y;
  w.place = place;
  w.walls = walls;
  w.at = Height(last + (std::int64_t{base} << kFractionBits));
}

void BeamRaster::walk(const CellPoint& origin, const CellPoint& end, BeamEnd kind) {
  Walk walk(origin, end);
  const bool level = std::abs(end.z() - origin.z()) < kLevelBeam;
  if (kind != BeamEnd::kNothing && !level && !count_glancing_) {
    walk.glancing_from = Height(to_units(end.z())).in - kGlancing;
    walk.glancing_count = 2 * kGlancing + 1;
  }
  while (walk.walls > 0) {
    const std::uint32_t base = walk.at.in & ~63u;
    const int walls = walk.walls;
    if (walk.at.within(base)) {
      Layer& here = layer(walk.key, word_of(static_cast<int>(base) + kLowest));
      if (walk.dz >= 0)
        walk_in_layer<true>(walk, here, base);
      else
        walk_in_layer<false>(walk, here, base);
    }
    if (walk.walls == walls) {  // it leaves the layer within this column
      const Height to = walk.leaves();
      mark_levels(walk, to);
      walk.at = to;
      walk.step();
    }
  }
  if (kind != BeamEnd::kFlatReturn) mark_levels(walk, Height(walk.z0 + walk.dz));
}

}  // namespace hm::mvog
