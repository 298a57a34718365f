// Depth units to metres and tile extremes, with vectors (Highway), in one pass over the image.
#include "hm/tsdf/projection/depth_preparation.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hm/tsdf/projection/depth_preparation.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef HM_TSDF_DEPTH_ROW
#define HM_TSDF_DEPTH_ROW
namespace hm {
/// Range limits in the units of the image, and the size of a unit.
struct DepthLimits {
  std::uint16_t near_units = 1;  ///< nearest accepted, at least 1
  std::uint16_t far_units = 0;   ///< farthest accepted
  float unit_m = 0;
};
/// One image row; extremes of columns are accumulated over the rows of a tile.
struct DepthRow {
  const std::uint16_t* units = nullptr;
  const std::uint16_t* edge = nullptr;  ///< 0xffff or 0
  float* depth_m = nullptr;
  float* column_min_m = nullptr;
  float* column_max_m = nullptr;
  std::size_t width = 0;
  const Rgb8* color = nullptr;
};
struct DepthCounts {
  std::size_t in_range = 0, valid = 0;
};
}  // namespace hm
#endif

HWY_BEFORE_NAMESPACE();
namespace hm {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void PrepareRow(const DepthLimits& limits, const DepthRow& row, DepthCounts& counts) {
  const hn::CappedTag<float, 16> df;
  const hn::RebindToSigned<decltype(df)> di;
  const hn::Rebind<std::uint16_t, decltype(df)> d16;
  const auto lanes = hn::Lanes(df);
  const auto near_units = hn::Set(di, limits.near_units), far_units = hn::Set(di, limits.far_units);
  const auto unit = hn::Set(df, limits.unit_m), far_m = hn::Set(df, PreparedDepth::kFarM);
  std::size_t in_range = 0, valid = 0, x = 0;
  for (; x + lanes <= row.width; x += lanes) {
    const auto units = hn::PromoteTo(di, hn::LoadU(d16, row.units + x));
    if (row.color) hwy::Prefetch(row.color + x);  // 48 bytes a round: every cache line
    const auto near_enough = hn::Not(hn::Gt(units, far_units));
    const auto beyond_near = hn::Not(hn::Gt(near_units, units));
    const auto accepted = hn::RebindMask(df, hn::And(near_enough, beyond_near));
    const auto metres = hn::Mul(hn::ConvertTo(df, units), unit);
    const auto kept =
        hn::IfThenElseZero(hn::RebindMask(df, beyond_near), hn::IfThenElse(accepted, metres, far_m));
    const auto sign = hn::ShiftLeft<31>(hn::PromoteTo(di, hn::LoadU(d16, row.edge + x)));
    hn::StoreU(hn::BitCast(df, hn::Or(hn::BitCast(di, kept), sign)), df, row.depth_m + x);
    const auto low = hn::IfThenElse(accepted, metres, far_m), high = hn::IfThenElseZero(accepted, metres);
    hn::StoreU(hn::Min(hn::LoadU(df, row.column_min_m + x), low), df, row.column_min_m + x);
    hn::StoreU(hn::Max(hn::LoadU(df, row.column_max_m + x), high), df, row.column_max_m + x);
    in_range += hn::CountTrue(df, accepted);
    valid += hn::CountTrue(di, hn::Gt(units, hn::Zero(di)));
  }
  for (; x < row.width; ++x) {
    const std::uint16_t units = row.units[x];
    const bool beyond_near = units >= limits.near_units, accepted = beyond_near && units <= limits.far_units;
    const float metres = static_cast<float>(units) * limits.unit_m;
    const float kept = accepted ? metres : beyond_near ? PreparedDepth::kFarM : 0.0f;
    row.depth_m[x] = row.edge[x] != 0 ? -kept : kept;
    if (accepted) {
      row.column_min_m[x] = std::min(row.column_min_m[x], metres);
      row.column_max_m[x] = std::max(row.column_max_m[x], metres);
    }
    in_range += accepted ? 1u : 0u;
    valid += units != 0 ? 1u : 0u;
  }
  counts.in_range += in_range;
  counts.valid += valid;
}

}  // namespace HWY_NAMESPACE
}  // namespace hm
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hm {
HWY_EXPORT(PrepareRow);

namespace {

DepthLimits limits_of(const RawDepth& raw) {
  const auto units = [&](double metres) { return std::clamp(metres / raw.depth.unit_m, 0.0, 65535.0); };
  DepthLimits limits;
  limits.near_units = static_cast<std::uint16_t>(std::max(1.0, std::ceil(units(raw.near_m))));
  limits.far_units = static_cast<std::uint16_t>(std::floor(units(raw.far_m)));
  limits.unit_m = static_cast<float>(raw.depth.unit_m);
  return limits;
}

/// True when a tile has a reading beyond far.
bool sees_far(const Image<float>& depth_m, int tile_x, int tile_y) {
  const int end_x = std::min((tile_x + 1) * kTileSide, depth_m.width());
  const int end_y = std::min((tile_y + 1) * kTileSide, depth_m.height());
  for (int y = tile_y * kTileSide; y < end_y; ++y)
    for (int x = tile_x * kTileSide; x < end_x; ++x)
      if (std::abs(depth_m(x, y)) == PreparedDepth::kFarM) return true;
  return false;
}

/// Removes readings at edges whose weight is rounded to 0 because of their distance.
void drop_weightless(const RawDepth& raw, const DepthLimits& limits, const std::vector<std::uint16_t>& edge,
                     std::vector<std::uint16_t>& units) {
  if (observation_weight(raw.edge_weight_numerator, raw.truncation.max_m) > 0) return;
  for (std::size_t x = 0; x < units.size(); ++x) {
    if (edge[x] == 0) continue;
    const bool is_far = units[x] > limits.far_units;
    const float depth_m = is_far ? PreparedDepth::kFarM : static_cast<float>(units[x]) * limits.unit_m;
    if (observation_weight(raw.edge_weight_numerator, raw.truncation.at(depth_m)) == 0) units[x] = 0;
  }
}

/// Prepares the rows of one row of tiles.
DepthCounts prepare_tile_row(const RawDepth& raw, const DepthLimits& limits, int tile_y,
                             PreparedDepth& prepared) {
  const DepthImage& depth = raw.depth;
  const auto width = static_cast<std::size_t>(depth.width());
  thread_local std::vector<float> column_min, column_max;
  thread_local std::vector<std::uint16_t> units, edge;
  units.resize(width);
  edge.resize(width);
  column_min.assign(width, PreparedDepth::kFarM);
  column_max.assign(width, 0.0f);
  DepthCounts counts;
  const int end = std::min((tile_y + 1) * kTileSide, depth.height());
  for (int y = tile_y * kTileSide; y < end; ++y) {
    const int last = depth.height() - 1;
    sort_out_edges(raw.edges,
                   {depth.units.row(std::max(y - 1, 0)).data(), depth.units.row(y).data(),
                    depth.units.row(std::min(y + 1, last)).data(), width},
                   units.data(), edge.data());
    drop_weightless(raw, limits, edge, units);
    HWY_DYNAMIC_DISPATCH(PrepareRow)
    (limits,
     {units.data(), edge.data(), prepared.depth_m.row(y).data(), column_min.data(), column_max.data(), width,
      raw.color ? raw.color->row(y).data() : nullptr},
     counts);
  }
  for (int tile_x = 0; tile_x < prepared.tiles_x; ++tile_x) {
    const auto begin = static_cast<std::size_t>(tile_x * kTileSide);
    const std::size_t stop = std::min(begin + kTileSide, width);
    const auto tile = static_cast<std::size_t>(tile_y * prepared.tiles_x + tile_x);
    float low = PreparedDepth::kFarM, high = 0.0f;
    for (std::size_t x = begin; x < stop; ++x) {
      low = std::min(low, column_min[x]);
      high = std::max(high, column_max[x]);
    }
    if (high == 0.0f && sees_far(prepared.depth_m, tile_x, tile_y)) high = PreparedDepth::kOpen;
    prepared.tile_min_m[tile] = low;
    prepared.tile_max_m[tile] = high;
  }
  return counts;
}

}  // namespace

void prepare_depth(const RawDepth& raw, const ParallelLoop& loop, PreparedDepth& prepared) {
  const DepthImage& depth = raw.depth;
  if (prepared.depth_m.width() != depth.width() || prepared.depth_m.height() != depth.height())
    prepared.depth_m = Image<float>(depth.width(), depth.height());
  prepared.tiles_x = (depth.width() + kTileSide - 1) / kTileSide;
  prepared.tiles_y = (depth.height() + kTileSide - 1) / kTileSide;
  const auto tiles = static_cast<std::size_t>(prepared.tiles_x) * static_cast<std::size_t>(prepared.tiles_y);
  prepared.tile_min_m.resize(tiles);
  prepared.tile_max_m.resize(tiles);
  const DepthLimits limits = limits_of(raw);
  std::atomic<std::size_t> in_range{0}, valid{0};  // sums of whole numbers: the same in any order
  loop.for_ranges(static_cast<std::size_t>(prepared.tiles_y), 4, [&](std::size_t begin, std::size_t end) {
    DepthCounts sum;
    for (std::size_t tile_y = begin; tile_y < end; ++tile_y) {
      const DepthCounts counts = prepare_tile_row(raw, limits, static_cast<int>(tile_y), prepared);
      sum.in_range += counts.in_range;
      sum.valid += counts.valid;
    }
    in_range += sum.in_range;
    valid += sum.valid;
  });
  prepared.pixels_in_range = in_range;
  prepared.pixels_valid = valid;
}

}  // namespace hm
#endif
