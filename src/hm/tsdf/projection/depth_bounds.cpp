// Bounds for the parts of a volume, with vectors (Highway): compiled once per instruction set.
#include "hm/tsdf/projection/depth_bounds.hpp"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hm/tsdf/projection/depth_bounds.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "hm/sensors/vectors_inl.hpp"

#ifndef HM_TSDF_CENTRES
#define HM_TSDF_CENTRES
namespace hm {
/// x, y, z of 32 boxes in the form of DepthBounds::part_centre.
using Centres = std::array<std::array<float, 32>, 3>;
}  // namespace hm
#endif

HWY_BEFORE_NAMESPACE();
namespace hm {
namespace HWY_NAMESPACE {

/// Combines windows: minimum of each half of a word.
HWY_INLINE VU MinOfHalves(VU a, VU b) {
  const DU du;
  const VU low = hn::Set(du, 0xffffu);
  const VU lows = hn::Min(hn::And(a, low), hn::And(b, low));
  return hn::Or(lows, hn::Min(hn::AndNot(low, a), hn::AndNot(low, b)));
}

/// Boxes around points in the camera's frame: x and y in pixels from the principal point times metres.
struct Boxes {
  VF x, y, z;  ///< centres
};

/// Projections of boxes along one axis of the image.
struct Spans {
  MF visible;
  VI first, count;  ///< tiles
};

/// Every point of the box projects between lowest and highest X / Z for X and Z from their intervals.
HWY_INLINE Spans SpansOf(VF centre, float extent, VF per_nearest, VF per_farthest, float principal_px,
                         float size_px, int tiles) {
  const DF d;
  const DI di;
  constexpr float kSlackPx = 0.02f;  // single precision
  const VF zero = hn::Zero(d), half = hn::Set(d, extent);
  const VF low = hn::Sub(centre, half), high = hn::Add(centre, half);
  const VF low_px = hn::Add(hn::Mul(low, hn::IfThenElse(hn::Lt(low, zero), per_nearest, per_farthest)),
                            hn::Set(d, principal_px + 0.5f - kSlackPx));
  const VF high_px = hn::Add(hn::Mul(high, hn::IfThenElse(hn::Gt(high, zero), per_nearest, per_farthest)),
                             hn::Set(d, principal_px + 0.5f + kSlackPx));
  const VF end_px = hn::Set(d, size_px);
  const auto tile = [&](VF px) HWY_ATTR {
    const VI whole = hn::ConvertTo(di, hn::Max(zero, hn::Min(px, end_px)));
    return hn::Min(hn::ShiftRight<3>(whole), hn::Set(di, tiles - 1));
  };
  Spans spans;
  spans.visible = hn::And(hn::Ge(high_px, zero), hn::Lt(low_px, end_px));
  spans.first = tile(low_px);
  spans.count = hn::Add(hn::Sub(tile(high_px), spans.first), hn::Set(di, 1));
  return spans;
}

/// Entries of the two windows that cover rectangles of tiles, and which rectangles are too large for them.
struct WindowPairs {
  VI left, right;
  MF too_large;
};

HWY_INLINE WindowPairs WindowsFor(const DepthBounds& bounds, const Spans& x, const Spans& y) {
  const DF d;
  const DI di;
  const VI one = hn::Set(di, 1);
  // The widest power of two that fits (from the exponent of a float), the lowest height that suffices.
  const VI exponent = hn::ShiftRight<23>(hn::BitCast(di, hn::ConvertTo(d, x.count)));
  const VI wanted = hn::Sub(exponent, hn::Set(di, 127));
  const VI last = hn::Set(di, DepthBounds::kWidths - 1), width = hn::Min(wanted, last);
  VI height = hn::Zero(di);
  for (std::size_t i = 0; i + 1 < DepthBounds::kHeights.size(); ++i) {
    const auto lower = hn::Gt(y.count, hn::Set(di, DepthBounds::kHeights[i]));
    height = hn::Add(height, hn::IfThenElseZero(lower, one));
  }
  const VI level = hn::Add(hn::Mul(height, hn::Set(di, DepthBounds::kWidths)), width);
  const VI row = hn::Add(hn::Mul(level, hn::Set(di, bounds.tiles_y)), y.first);
  WindowPairs pairs;
  pairs.left = hn::Add(hn::Mul(row, hn::Set(di, bounds.tiles_x)), x.first);
  pairs.right = hn::Add(pairs.left, hn::Sub(x.count, hn::Shl(one, width)));
  pairs.too_large = hn::RebindMask(
      d, hn::Or(hn::Gt(wanted, last), hn::Gt(y.count, hn::Set(di, DepthBounds::kHeights.back()))));
  return pairs;
}

struct Verdicts {
  MF in_band, in_front;
};

HWY_INLINE Verdicts Judge(const DepthBounds& bounds, const Boxes& boxes, const Eigen::Vector3f& extent) {
  const DF d;
  const DI di;
  const DU du;
  constexpr float kSlackM = 1e-4f, kNearestM = 0.05f;
  const VF half_z = hn::Set(d, extent[2] + kSlackM);
  const VF nearest = hn::Sub(boxes.z, half_z), farthest = hn::Add(boxes.z, half_z);
  const VF one = hn::Set(d, 1.0f), limit = hn::Set(d, kNearestM);
  const VF per_nearest = hn::Div(one, hn::Max(nearest, limit));
  const VF per_farthest = hn::Div(one, hn::Max(farthest, limit));
  const Spans x = SpansOf(boxes.x, extent[0], per_nearest, per_farthest, bounds.principal_px[0],
                          bounds.size_px[0], bounds.tiles_x);
  const Spans y = SpansOf(boxes.y, extent[1], per_nearest, per_farthest, bounds.principal_px[1],
                          bounds.size_px[1], bounds.tiles_y);
  const WindowPairs pairs = WindowsFor(bounds, x, y);
  const VU band = MinOfHalves(hn::GatherIndex(du, bounds.windows.data(), pairs.left),
                              hn::GatherIndex(du, bounds.windows.data(), pairs.right));
  const VF scale = hn::Set(d, bounds.units_per_m);
  const VF near_m = hn::ConvertTo(d, hn::BitCast(di, hn::And(band, hn::Set(du, 0xffffu))));
  const VF far_m = hn::Sub(hn::Set(d, 65535.0f), hn::ConvertTo(d, hn::BitCast(di, hn::ShiftRight<16>(band))));
  const VF last = hn::Mul(farthest, scale);
  const VF first = hn::Min(hn::Mul(nearest, scale), hn::Set(d, 65535.0f));  // open bands have no end
  // Too near or too large: everything that may be visible.
  const MF too_near = hn::Lt(nearest, limit);
  const MF unknown = hn::Or(too_near, pairs.too_large);
  const MF in_sight = hn::And(hn::Gt(farthest, hn::Zero(d)), hn::Or(too_near, hn::And(x.visible, y.visible)));
  const MF before_end = hn::Le(first, far_m);
  return {hn::And(in_sight, hn::Or(unknown, hn::And(before_end, hn::Ge(last, near_m)))),
          hn::And(in_sight, hn::Or(unknown, before_end))};
}

PartMasks PartsOf(const DepthBounds& bounds, const Eigen::Vector3f& origin) {
  const DF d;
  PartMasks masks{0, 0};
  for (std::size_t i = 0; i < 32; i += hn::Lanes(d)) {
    const auto along = [&](std::size_t axis) HWY_ATTR {
      return hn::Add(hn::Set(d, origin[static_cast<Eigen::Index>(axis)]),
                     hn::Load(d, bounds.part_centre[axis].data() + i));
    };
    const Verdicts verdicts = Judge(bounds, {along(0), along(1), along(2)}, bounds.part_extent);
    masks.in_band |= MaskBits(verdicts.in_band) << i;
    masks.in_front |= MaskBits(verdicts.in_front) << i;
  }
  return masks;
}

/// Bit mask of the volumes, of 32 with these centres, that have visible parts.
std::uint32_t SeenVolumes(const DepthBounds& bounds, const Centres& centres) {
  const DF d;
  std::uint32_t seen = 0;
  for (std::size_t i = 0; i < 32; i += hn::Lanes(d)) {
    const Boxes boxes{hn::Load(d, centres[0].data() + i), hn::Load(d, centres[1].data() + i),
                      hn::Load(d, centres[2].data() + i)};
    const Verdicts verdicts = Judge(bounds, boxes, bounds.volume_extent);
    seen |= MaskBits(hn::Or(verdicts.in_band, verdicts.in_front)) << i;
  }
  return seen;
}

/// Computes from windows at `from` those that extend `step` entries further, clipped at the last entry.
void Widen(const std::uint32_t* from, std::size_t step, std::size_t count, std::uint32_t* to) {
  const DU du;
  std::size_t i = 0;
  for (; i + step + hn::Lanes(du) <= count; i += hn::Lanes(du))
    hn::StoreU(MinOfHalves(hn::LoadU(du, from + i), hn::LoadU(du, from + i + step)), du, to + i);
  for (; i < count; ++i) {
    const std::uint32_t a = from[i], b = i + step < count ? from[i + step] : a;
    to[i] = std::min(a & 0xffffu, b & 0xffffu) | std::min(a & 0xffff0000u, b & 0xffff0000u);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace hm
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hm {
HWY_EXPORT(PartsOf);
HWY_EXPORT(SeenVolumes);
HWY_EXPORT(Widen);

namespace {

/// Truncation bands of the tiles themselves; all ones without readings.
void fill_bands(const PreparedDepth& depth, const ProjectionScan& scan, float units_per_m,
                std::uint32_t* bands) {
  const std::size_t tiles = depth.tile_min_m.size();
  for (std::size_t i = 0; i < tiles; ++i) {
    const float low = depth.tile_min_m[i], high = depth.tile_max_m[i];
    bands[i] = high == PreparedDepth::kOpen ? 0x0000ffffu : 0xffffffffu;
    if (high <= 0.0f) continue;
    const float tau = std::max(scan.truncation.at(low), scan.truncation.at(high));
    const auto near_units = static_cast<std::int32_t>(std::max(low - tau, 0.0f) * units_per_m);
    const auto far_units = static_cast<std::int32_t>((high + tau) * units_per_m) + 1;
    bands[i] = static_cast<std::uint32_t>(near_units) | static_cast<std::uint32_t>(65535 - far_units) << 16u;
  }
}

}  // namespace

void DepthBounds::build(const PreparedDepth& depth, const ProjectionScan& scan, const PinholeCamera& camera,
                        const ParallelLoop& loop) {
  scan_ = scan;
  tiles_x = depth.tiles_x;
  tiles_y = depth.tiles_y;
  principal_px = Eigen::Vector2f(static_cast<float>(camera.cx), static_cast<float>(camera.cy));
  size_px = Eigen::Vector2f(static_cast<float>(scan.width), static_cast<float>(scan.height));
  Mat3 step = scan.H * scan.voxel_size_m;  // without the principal point
  step.row(0) -= camera.cx * step.row(2);
  step.row(1) -= camera.cy * step.row(2);
  for (std::size_t part = 0; part < 32; ++part) {
    const Vec3 centre =
        step * Vec3(3.5, 2.0 * static_cast<double>(part % 4) + 0.5, static_cast<double>(part / 4));
    for (std::size_t axis = 0; axis < 3; ++axis)
      part_centre[axis][part] = static_cast<float>(centre[static_cast<Eigen::Index>(axis)]);
  }
  part_extent = (step.cwiseAbs() * Vec3(3.5, 0.5, 0.0)).cast<float>();
  volume_centre = (step * Vec3::Constant(3.5)).cast<float>();
  volume_extent = (step.cwiseAbs() * Vec3::Constant(3.5)).cast<float>();

  const float farthest = *std::max_element(depth.tile_max_m.begin(), depth.tile_max_m.end());
  units_per_m = 65000.0f / (std::max(farthest, 0.0f) + scan.truncation.max_m);
  fill_windows(depth, loop);
}

void DepthBounds::fill_windows(const PreparedDepth& depth, const ParallelLoop& loop) {
  const auto width = static_cast<std::size_t>(tiles_x), size = depth.tile_min_m.size();
  windows.resize(size * kWidths * kHeights.size());
  fill_bands(depth, scan_, units_per_m, windows.data());
  const auto level = [&](std::size_t i, std::size_t j) { return windows.data() + (j * kWidths + i) * size; };
  const auto widen = HWY_DYNAMIC_DISPATCH(Widen);
  for (std::size_t i = 1; i < kWidths; ++i)
    widen(level(i - 1, 0), std::size_t{1} << (i - 1), size, level(i, 0));
  loop.for_ranges(kWidths, 1, [&](std::size_t i, std::size_t) {
    for (std::size_t j = 1; j < kHeights.size(); ++j) {
      std::size_t from = j - 1;  // the lowest from which two make this height
      while (from > 0 && 2 * kHeights[from - 1] >= kHeights[j]) --from;
      widen(level(i, from), width * static_cast<std::size_t>(kHeights[j] - kHeights[from]), size,
            level(i, j));
    }
  });
}

PartMasks DepthBounds::parts_of(VolumeKey key) const {
  return HWY_DYNAMIC_DISPATCH(PartsOf)(*this, origin_of(key));
}

Eigen::Vector3f DepthBounds::origin_of(VolumeKey key) const {
  Eigen::Vector3f origin = scan_.origin_of(key);
  origin.head<2>() -= principal_px * origin.z();
  return origin;
}

void DepthBounds::drop_unseen(std::vector<VolumeKey>& keys) const {
  const auto seen_volumes = HWY_DYNAMIC_DISPATCH(SeenVolumes);
  alignas(64) Centres centres{};
  std::size_t kept = 0;
  for (std::size_t begin = 0; begin < keys.size(); begin += 32) {
    const std::size_t count = std::min<std::size_t>(keys.size() - begin, 32);
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3f centre = origin_of(keys[begin + i]) + volume_centre;
      for (std::size_t axis = 0; axis < 3; ++axis) centres[axis][i] = centre[static_cast<Eigen::Index>(axis)];
    }
    const std::uint32_t seen = seen_volumes(*this, centres);
    for (std::size_t i = 0; i < count; ++i)
      if (seen >> i & 1u) keys[kept++] = keys[begin + i];
  }
  keys.resize(kept);
}

}  // namespace hm
#endif
