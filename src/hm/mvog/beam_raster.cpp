#include "hm/mvog/beam_raster.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace hm::mvog {
namespace {

constexpr double kNearColumn = 0.25;
constexpr int kGlancing = 2;      ///< levels above and below the end
constexpr double kLevelBeam = 2;  ///< a level beam changes its height by less than this, in levels
/// Heights are integers in units of 2^-44 levels; beam parameters, up to 4 here, in units of 2^-60.
constexpr int kHeightBits = 44, kWordBits = kHeightBits + 6;
constexpr double kHeightUnits = 17592186044416.0, kShareUnits = 1152921504606846976.0;
constexpr std::int64_t kHalfLevel = std::int64_t{1} << (kHeightBits - 1);
constexpr std::int64_t kWordHeight = std::int64_t{1} << kWordBits;

std::int64_t to_units(double level) { return static_cast<std::int64_t>(level * kHeightUnits); }
int truncated_floor(double v) {
  const int i = static_cast<int>(v);
  return i - (v < i);
}
int level_of(std::int64_t z) { return static_cast<int>(z >> kHeightBits); }
/// First level whose centre is not below a height.
int next_level(std::int64_t z) { return static_cast<int>((z + kHalfLevel) >> kHeightBits); }
constexpr std::uint64_t bits_below(int level) {
  return level >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << level) - 1;
}

/// Masks for every half level of a word: the levels with their centre below it, and the level that contains
/// it.
struct HalfLevels {
  std::array<std::uint64_t, 128> below{}, in{};
  constexpr HalfLevels() {
    for (std::size_t i = 0; i < 128; ++i) {
      below[i] = bits_below(static_cast<int>(i + 1) / 2);
      in[i] = std::uint64_t{1} << i / 2;
    }
  }
  static std::size_t of(std::int64_t z_in_word) {
    return static_cast<std::uint64_t>(z_in_word) >> (kHeightBits - 1);
  }
};
constexpr HalfLevels kHalfLevels;

}  // namespace

void BeamRaster::begin(const CellPoint& origin, int bottom, bool count_glancing) {
  count_glancing_ = count_glancing;
  layers_.begin(bottom);
  bottom_ = bottom;
  origin_ = origin - CellPoint(0, 0, bottom);
  origin_x_ = truncated_floor(origin.x());
  origin_y_ = truncated_floor(origin.y());
}

/// Marks two levels in the column of an end, and in the columns nearby.
void BeamRaster::mark_end(const CellPoint& end) {
  const int x = truncated_floor(end.x()), y = truncated_floor(end.y()),
            level = truncated_floor(end.z() + 0.5) - 1;
  const TileKey patch = ScanLayers::patch_of(x, y);
  const double u = end.x() - x, v = end.y() - y;
  const int dx = (u >= 1 - kNearColumn) - (u < kNearColumn), dy = (v >= 1 - kNearColumn) - (v < kNearColumn);
  const auto mark = [&](int number, std::uint64_t levels) {
    ScanLayer& layer = layers_.at(patch, number);
    layers_.word(layer, ScanLayer::place(x, y)).hit |= levels;
    // Without a near column this marks the end's own one, in which the hit takes precedence.
    const auto beside = [&](int near_x, int near_y) {
      const TileKey there = ScanLayers::patch_of(near_x, near_y);
      ScanLayer& near = there == patch ? layer : layers_.at(there, number);
      layers_.word(near, ScanLayer::place(near_x, near_y)).beside |= levels;
    };
    beside(x + dx, y);
    beside(x, y + dy);
    beside(x + dx, y + dy);
  };
  mark(level >> 6, std::uint64_t{3} << (level & 63));
  if ((level & 63) == 63) mark((level + 1) >> 6, 1);
}

void BeamRaster::add_return(const CellPoint& end_of_beam) {
  const CellPoint end = end_of_beam - CellPoint(0, 0, bottom_);
  const CellPoint d = end - origin_;
  const bool steep = d.z() * d.z() > 4 * (d.x() * d.x() + d.y() * d.y());  // a level is half a cell
  walk(end, steep ? BeamEnd::kSteepReturn : BeamEnd::kFlatReturn);
  mark_end(end);
}

void BeamRaster::add_no_return(const CellPoint& end) {
  walk(end - CellPoint(0, 0, bottom_), BeamEnd::kNothing);
}

/// State of traversing a beam over columns. Column borders are crossed at fractions of the beam; the earlier
/// one of the next crossings in x and y is where it leaves the current column.
struct BeamRaster::Walk {
  TileKey patch;
  unsigned place;          ///< there
  int step_x, step_y;      ///< of the place
  int walls;               ///< number of borders left to cross
  std::int64_t x_after_y;  ///< next crossing in x minus next crossing in y
  std::int64_t per_x, per_y, z_x, z_y, dz_x,
      dz_y;                                   ///< increments between crossings; heights at the next crossings
  std::int64_t z;                             ///< height at which it entered this column
  int glancing_from = 0, glancing_count = 0;  ///< levels that it misses only by crossing their centre

  /// One of the two directions: fraction and height at the first crossing, and increments between crossings.
  struct Axis {
    double from, to;
    int cell, walls;
  };
  void set_axis(const Axis& a, double z0, double dz, double& first, std::int64_t& per, std::int64_t& z_first,
                std::int64_t& dz_per) {
    const double inverse = 1 / (a.to - a.from);
    first = a.walls > 0 ? (a.cell + (a.to > a.from) - a.from) * inverse : 2;
    // With a single crossing, the next one is beyond the end.
    const bool more = a.walls > 1;
    const double share = std::abs(inverse);
    per = static_cast<std::int64_t>((more ? share : 2.0) * kShareUnits);
    z_first = to_units(z0 + dz * first);
    dz_per = to_units(more ? dz * share : 0.0);
  }
  Walk(const BeamRaster& raster, const CellPoint& end) {
    const CellPoint& origin = raster.origin_;
    const int x = raster.origin_x_, y = raster.origin_y_;
    patch = ScanLayers::patch_of(x, y);
    place = ScanLayer::place(x, y);
    step_x = end.x() < origin.x() ? -1 : 1;
    step_y = end.y() < origin.y() ? -ScanLayer::kRow : ScanLayer::kRow;
    const int walls_x = std::abs(truncated_floor(end.x()) - x),
              walls_y = std::abs(truncated_floor(end.y()) - y);
    walls = walls_x + walls_y;
    const double dz = end.z() - origin.z();
    double t_x = 0, t_y = 0;
    set_axis({origin.x(), end.x(), x, walls_x}, origin.z(), dz, t_x, per_x, z_x, dz_x);
    set_axis({origin.y(), end.y(), y, walls_y}, origin.z(), dz, t_y, per_y, z_y, dz_y);
    x_after_y = static_cast<std::int64_t>((t_x - t_y) * kShareUnits);
    z = to_units(origin.z());
  }
  [[nodiscard]] std::int64_t z_out() const { return x_after_y < 0 ? z_x : z_y; }
  [[nodiscard]] bool glances(int level) const {
    return static_cast<unsigned>(level - glancing_from) < static_cast<unsigned>(glancing_count);
  }
  void step_in_x() {
    z_x += dz_x;
    x_after_y += per_x;
    place += static_cast<unsigned>(step_x);
    --walls;
  }
  void step_in_y() {
    z_y += dz_y;
    x_after_y -= per_y;
    place += static_cast<unsigned>(step_y);
    --walls;
  }
  /// Advances to the next column.
  void step() {
    z = z_out();
    x_after_y < 0 ? step_in_x() : step_in_y();
    settle();
  }
  /// Switches to the next patch, if the last step left the current one.
  void settle() {
    if (place & kPatchSide) {
      place = (place - static_cast<unsigned>(step_x)) ^ (kPatchSide - 1u);
      patch.x += step_x;
    } else if (place & ScanLayer::kOutside) {
      place = (place - static_cast<unsigned>(step_y)) ^ (kPatchSide - 1u) * ScanLayer::kRow;
      patch.y += step_y / ScanLayer::kRow;
    }
  }
};

/// Marks the part of a beam in this column up to a height.
void BeamRaster::mark_column(const Walk& w, std::int64_t to_z) {
  const int first = next_level(std::min(w.z, to_z)), end = next_level(std::max(w.z, to_z));
  for (int number = first >> 6; number <= (end - 1) >> 6; ++number) {
    const int low = std::max(first - number * 64, 0), high = std::min(end - number * 64, 64);
    layers_.word(layers_.at(w.patch, number), w.place).miss |= bits_below(high) & ~bits_below(low);
  }
  if (first != end) return;
  const int level = level_of(to_z);
  ObservationWord& word = layers_.word(layers_.at(w.patch, level >> 6), w.place);
  (w.glances(level) ? word.brush : word.miss) |= std::uint64_t{1} << (level & 63);
}

/// Traverses columns as long as the beam stays in a layer and, depending on `kNearEnd`, inside or outside the
/// levels where it may be grazing. The hot loop of a scan: a separate function, so that all variables stay in
/// registers.
template <bool kRises, bool kNearEnd>
[[gnu::noinline]] void BeamRaster::walk_in_layer(Walk& walk, ScanLayer& layer) {
  const std::int64_t base = std::int64_t{layer.number} << kWordBits;
  std::int64_t low = 0, high = kWordHeight;
  if (kNearEnd || walk.glancing_count > 0) {
    const std::int64_t from = (std::int64_t{walk.glancing_from} << kHeightBits) - base;
    const std::int64_t end = from + (std::int64_t{walk.glancing_count} << kHeightBits);
    if (kNearEnd || !kRises) low = std::clamp<std::int64_t>(kNearEnd ? from : end, low, high);
    if (kNearEnd || kRises) high = std::clamp<std::int64_t>(kNearEnd ? end : from, low, high);
  }
  const auto height = static_cast<std::uint64_t>(high - low);
  Walk w = walk;
  w.z_x -= base;
  w.z_y -= base;
  std::uint64_t below = kHalfLevels.below[HalfLevels::of(w.z - base)];
  // Marks the column up to this height; false when another variant of this function must continue.
  const auto mark = [&](std::int64_t z) {
    if (static_cast<std::uint64_t>(z - low) >= height) return false;
    const std::size_t half = HalfLevels::of(z);
    const std::uint64_t crossed = below ^ kHalfLevels.below[half];
    below ^= crossed;
    const std::uint64_t leaves_in = kHalfLevels.in[half] & (static_cast<std::uint64_t>(crossed != 0) - 1);
    ObservationWord& word = layers_.word(layer, w.place);
    word.miss |= kNearEnd ? crossed : crossed | leaves_in;
    if (kNearEnd) word.brush |= leaves_in;
    w.z = z;
    return true;
  };
  do {
    if (w.x_after_y < 0) {
      if (!mark(w.z_x)) break;
      w.step_in_x();
    } else {
      if (!mark(w.z_y)) break;
      w.step_in_y();
    }
  } while (w.walls > 0 && (w.place & ScanLayer::kOutside) == 0);
  w.z_x += base;
  w.z_y += base;
  w.z += walk.walls == w.walls ? 0 : base;
  w.settle();
  walk = w;
}

void BeamRaster::walk(const CellPoint& end, BeamEnd kind) {
  Walk walk(*this, end);
  const double dz = end.z() - origin_.z();
  if (kind != BeamEnd::kNothing && std::abs(dz) >= kLevelBeam && !count_glancing_) {
    walk.glancing_from = truncated_floor(end.z()) - kGlancing;
    walk.glancing_count = 2 * kGlancing + 1;
  }
  while (walk.walls > 0) {
    const int walls = walk.walls;
    ScanLayer& layer = layers_.at(walk.patch, static_cast<int>(walk.z >> kWordBits));
    dz >= 0 ? walk_in_layer<true, false>(walk, layer) : walk_in_layer<false, false>(walk, layer);
    if (walk.walls == walls && walk.glancing_count > 0)
      dz >= 0 ? walk_in_layer<true, true>(walk, layer) : walk_in_layer<false, true>(walk, layer);
    if (walk.walls == walls) {  // it leaves the layer within this column
      mark_column(walk, walk.z_out());
      walk.step();
    }
  }
  if (kind != BeamEnd::kFlatReturn) mark_column(walk, to_units(end.z()));
}

}  // namespace hm::mvog
