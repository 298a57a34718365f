// Voxel projection with vectors: compiled once per instruction set, chosen at run time (Highway).
#include <hwy/cache_control.h>

#include "hm/tsdf/projection_scan.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hm/tsdf/projection_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "hm/tsdf/update_filters-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace hm {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// The scan's constants as vectors.
struct Constants {
  VF half_below, max_u, max_v, zero, quadratic, linear, constant, min_tau, max_tau, weight_numerator,
      edge_weight_numerator, margin;
  VF units_per_m, weight_cap, color_band, carving_factor;
  VI width, tiles_x;
  bool fixed_truncation;  ///< and so are the weights
  VF fixed_weight, fixed_edge_weight;
  explicit HWY_INLINE Constants(const ProjectionScan& s) {
    const DF d;
    const DI di;
    half_below = hn::Set(d, -0.5f);
    max_u = hn::Set(d, s.max_u);
    max_v = hn::Set(d, s.max_v);
    zero = hn::Zero(d);
    quadratic = hn::Set(d, s.truncation.quadratic);
    linear = hn::Set(d, s.truncation.linear);
    constant = hn::Set(d, s.truncation.constant);
    min_tau = hn::Set(d, s.truncation.min_m);
    max_tau = hn::Set(d, s.truncation.max_m);
    weight_numerator = hn::Set(d, s.weight_numerator);
    edge_weight_numerator = hn::Set(d, s.edge_weight_numerator);
    margin = hn::Set(d, s.carving_margin_m);
    units_per_m = hn::Set(d, s.sdf_units_per_m);
    weight_cap = hn::Set(d, s.weight_cap);
    color_band = hn::Set(d, s.color_band_m);
    carving_factor = hn::Set(d, s.carving_factor);
    width = hn::Set(di, s.width);
    tiles_x = hn::Set(di, s.tiles_x);
    fixed_truncation = s.truncation.min_m == s.truncation.max_m;
    fixed_weight = hn::ConvertTo(d, hn::NearestInt(hn::Div(weight_numerator, min_tau)));
    fixed_edge_weight = hn::ConvertTo(d, hn::NearestInt(hn::Div(edge_weight_numerator, min_tau)));
  }
};

HWY_INLINE std::uint64_t MaskBits(DF d, MF mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < (hn::Lanes(d) + 7) / 8; ++i) bits |= std::uint64_t{bytes[i]} << (8 * i);
  return bits;
}

/// Where the voxels of a vector fall, and the readings there: 0 for none, negative at edges.
struct Lookups {
  VI column, row, pixel;
  VF signed_depth;
};

HWY_INLINE Lookups LookUp(const ProjectionScan& scan, const Constants& c, VF hx, VF hy, VF hz) {
  const DF d;
  Lookups l;
  const VF inverse = hn::Div(hn::Set(d, 1.0f), hz);
  const VF u = hn::Mul(hx, inverse), v = hn::Mul(hy, inverse);
  const MF inside = hn::And(hn::And(hn::Gt(hz, c.zero), hn::And(hn::Ge(u, c.half_below), hn::Lt(u, c.max_u))),
                            hn::And(hn::Ge(v, c.half_below), hn::Lt(v, c.max_v)));
  l.column = hn::NearestInt(hn::IfThenElseZero(inside, u));
  l.row = hn::NearestInt(hn::IfThenElseZero(inside, v));
  l.pixel = hn::Add(hn::Mul(l.row, c.width), l.column);
  l.signed_depth = hn::IfThenElseZero(inside, hn::GatherIndex(d, scan.depth_m, l.pixel));
  return l;
}

/// How voxels at depth z lie to their readings.
struct Comparison {
  VF u, tau;       ///< in front by u; truncation
  MF hit, beyond;  ///< in the truncation band; in front of it by more than the margin
};

HWY_INLINE Comparison Compare(const Constants& c, VF signed_depth, VF z) {
  const VF depth = hn::Abs(signed_depth);
  const VF polynomial = hn::Add(hn::Mul(hn::Add(hn::Mul(c.quadratic, depth), c.linear), depth), c.constant);
  Comparison found;
  found.u = hn::Sub(depth, z);
  found.tau = hn::Min(hn::Max(polynomial, c.min_tau), c.max_tau);
  const MF valid = hn::Gt(depth, c.zero);
  found.hit = hn::And(valid, hn::And(hn::Ge(found.u, hn::Neg(found.tau)), hn::Le(found.u, found.tau)));
  found.beyond = hn::And(valid, hn::Gt(found.u, hn::Add(found.tau, c.margin)));
  return found;
}

HWY_INLINE MF ColorLanes(const Constants& c, const Comparison& l) {
  return hn::And(l.hit, hn::And(hn::Ge(l.u, hn::Neg(c.color_band)), hn::Le(l.u, c.color_band)));
}

/// The weight of observations, in 1/kWeightOne.
HWY_INLINE VF WeightOf(const Constants& c, VF signed_depth, VF tau) {
  const MF at_edge = hn::Lt(signed_depth, c.zero);
  if (c.fixed_truncation) return hn::IfThenElse(at_edge, c.fixed_edge_weight, c.fixed_weight);
  const VF numerator = hn::IfThenElse(at_edge, c.edge_weight_numerator, c.weight_numerator);
  return hn::ConvertTo(DF(), hn::NearestInt(hn::Div(numerator, tau)));
}

/// What has been found out about one volume so far.
struct Tally {
  std::uint64_t changed_xy = 0;  ///< any z: bit 8 y + x
  std::uint8_t z_layers = 0;
  VolumeUpdate update;
};

/// Vectors of a volume that have something to do, with what was looked up for them.
struct Selection {
  HWY_ALIGN float z[kVolumeVoxels];
  HWY_ALIGN float signed_depth[kVolumeVoxels];
  HWY_ALIGN std::int32_t pixel[kVolumeVoxels];
  HWY_ALIGN std::int32_t tile[kVolumeVoxels];  ///< for carving
  int first_voxel[kVolumeVoxels];
  int count = 0;
  int colored_at[kVolumeVoxels];  ///< places of those that take colour
  int colored_count = 0;
};

/// Second pass: observations and carving for the vector at place `at` of the selection.
template <bool kCarving>
HWY_INLINE void UpdateVector(const ProjectionScan& scan, const Constants& c, const ProjectionTask& task,
                             Selection& selection, int at, Tally& tally) {
  const DF d;
  const DI di;
  const DU du;
  const int first = selection.first_voxel[at];
  const auto offset = at * static_cast<int>(hn::Lanes(d));
  const VF z = hn::Load(d, selection.z + offset), signed_depth = hn::Load(d, selection.signed_depth + offset);
  const Comparison l = Compare(c, signed_depth, z);
  auto* words = reinterpret_cast<std::int32_t*>(task.voxels) + first;
  const VI bits = hn::Load(di, words);
  const VI sdf = hn::ShiftRight<16>(hn::ShiftLeft<16>(bits));
  const VI weight = hn::BitCast(di, hn::ShiftRight<16>(hn::BitCast(du, bits)));
  VI result = bits;
  MF changed = l.hit;
  const VF observation = WeightOf(c, signed_depth, l.tau);
  const bool any_hit = !hn::AllFalse(d, l.hit);
  if (any_hit) {
    const VF sample =
        hn::ConvertTo(d, hn::NearestInt(hn::IfThenElseZero(l.hit, hn::Mul(l.u, c.units_per_m))));
    const VF mean = hn::ConvertTo(d, sdf), old_weight = hn::ConvertTo(d, weight);
    const VF new_weight = hn::Add(old_weight, observation);
    const VF moved = hn::Add(mean, FilterStep(d, hn::Sub(sample, mean), hn::Div(observation, new_weight)));
    const VI moved_sdf = hn::ConvertTo(di, moved);
    const VI new_bits = hn::Or(hn::And(moved_sdf, hn::Set(di, 0xffff)),
                               hn::ShiftLeft<16>(hn::ConvertTo(di, hn::Min(new_weight, c.weight_cap))));
    result = hn::IfThenElse(hn::RebindMask(di, l.hit), new_bits, result);
    tally.update.interior_hit |= !hn::AllFalse(d, hn::And(l.hit, hn::Le(moved, c.zero)));
    tally.update.updated += static_cast<std::uint32_t>(hn::CountTrue(d, l.hit));
  }
  if constexpr (kCarving) {
    const VI zero_i = hn::Zero(di);
    const MF stale = hn::RebindMask(d, hn::And(hn::Gt(weight, zero_i), hn::Lt(sdf, hn::Set(di, 1))));
    MF beyond = hn::And(l.beyond, stale);
    if (!hn::AllFalse(d, beyond)) {
      const VF tile_min = hn::GatherIndex(d, scan.tile_min_m, hn::Load(di, selection.tile + offset));
      beyond = hn::And(beyond, hn::Gt(hn::Sub(tile_min, z), hn::Add(l.tau, c.margin)));
      const VF taken = hn::ConvertTo(d, hn::NearestInt(hn::Mul(observation, c.carving_factor)));
      const VF left = hn::Sub(hn::ConvertTo(d, weight), taken);
      const VI kept = hn::Or(hn::And(sdf, hn::Set(di, 0xffff)), hn::ShiftLeft<16>(hn::ConvertTo(di, left)));
      const VI carved = hn::IfThenElseZero(hn::RebindMask(di, hn::Gt(left, c.zero)), kept);
      result = hn::IfThenElse(hn::RebindMask(di, beyond), carved, result);
      changed = hn::Or(changed, beyond);
      tally.update.carved += static_cast<std::uint32_t>(hn::CountTrue(d, beyond));
    }
  }
  hn::Store(result, di, words);
  if (const std::uint64_t changed_bits = MaskBits(d, changed)) {
    tally.changed_xy |= changed_bits << (first & 63);
    tally.z_layers = static_cast<std::uint8_t>(tally.z_layers | 1u << (first >> 6));
  }
  if (task.colors) {
    hwy::Prefetch(task.colors + first);
    selection.colored_at[selection.colored_count] = at;
    selection.colored_count += hn::AllFalse(d, ColorLanes(c, l)) ? 0 : 1;
  }
}

/// Third pass: colour, near the surface only.
HWY_INLINE void UpdateColors(const ProjectionScan& scan, const Constants& c, const ProjectionTask& task,
                             const Selection& selection, Tally& tally) {
  const DF d;
  const DI di;
  const DU du;
  for (int i = 0; i < selection.colored_count; ++i) {
    const int at = selection.colored_at[i];
    const auto offset = at * static_cast<int>(hn::Lanes(d));
    const MF colored = ColorLanes(
        c, Compare(c, hn::Load(d, selection.signed_depth + offset), hn::Load(d, selection.z + offset)));
    const VI pixel = hn::IfThenElseZero(hn::RebindMask(di, colored), hn::Load(di, selection.pixel + offset));
    auto* words = reinterpret_cast<std::uint32_t*>(task.colors) + selection.first_voxel[at];
    AddColors(words, GatherRgb(du, scan.rgb, pixel), colored, scan.color_cap);
    tally.update.colored += static_cast<std::uint32_t>(hn::CountTrue(d, colored));
  }
}

/// The voxels of a vector that could be carved: known, on or behind a surface.
HWY_INLINE MF StaleLanes(const TsdfVoxel* voxels) {
  const DI di;
  const DU du;
  const VI bits = hn::Load(di, reinterpret_cast<const std::int32_t*>(voxels));
  const auto known = hn::Ne(hn::ShiftRight<16>(hn::BitCast(du, bits)), hn::Zero(du));
  return hn::RebindMask(DF(),
                        hn::And(hn::RebindMask(di, known), hn::Lt(hn::ShiftLeft<16>(bits), hn::Set(di, 1))));
}

/// Of `parts`, those that hold something that could be carved.
HWY_INLINE std::uint32_t StaleParts(const TsdfVoxel* voxels, std::uint32_t parts) {
  const DF d;
  std::uint32_t stale = 0;
  for (; parts != 0; parts &= parts - 1) {
    const auto part = hwy::Num0BitsBelowLS1Bit_Nonzero32(parts);
    for (std::size_t i = 0; i < 16; i += hn::Lanes(d))
      stale |= static_cast<std::uint32_t>(!hn::AllFalse(d, StaleLanes(voxels + 16 * part + i))) << part;
  }
  return stale;
}

/// First pass: looks everything up, so that the waits for memory overlap, and keeps what has work to do.
template <bool kCarving>
HWY_INLINE void Select(const ProjectionScan& scan, const Constants& c, const ProjectionTask& task,
                       Selection& selection) {
  const DF d;
  const DI di;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const Eigen::Vector3f origin = scan.origin_of(task.key);
  std::uint32_t parts = task.parts.in_band;
  if constexpr (kCarving) parts |= StaleParts(task.voxels, task.parts.in_front & ~parts);
  for (; parts != 0; parts &= parts - 1) {
    const auto part = static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(parts));
    const auto z = static_cast<float>(part >> 2);
    for (int first = 16 * part; first < 16 * (part + 1); first += lanes) {
      const auto along = [&](int row) HWY_ATTR {
        return hn::Add(hn::Set(d, origin[row] + z * scan.step_z[row]),
                       hn::Load(d, scan.lane[row] + (first & 63)));
      };
      const VF hz = along(2);
      const Lookups l = LookUp(scan, c, along(0), along(1), hz);
      const Comparison found = Compare(c, l.signed_depth, hz);
      const int offset = selection.count * lanes;
      hn::Store(hz, d, selection.z + offset);
      hn::Store(l.signed_depth, d, selection.signed_depth + offset);
      hn::Store(l.pixel, di, selection.pixel + offset);
      bool kept = !hn::AllFalse(d, found.hit);
      if constexpr (kCarving) {
        const VI tile = hn::Add(hn::Mul(hn::ShiftRight<3>(l.row), c.tiles_x), hn::ShiftRight<3>(l.column));
        hn::Store(tile, di, selection.tile + offset);
        kept |= !hn::AllFalse(d, hn::And(found.beyond, StaleLanes(task.voxels + first)));
      }
      selection.first_voxel[selection.count] = first;
      selection.count += kept ? 1 : 0;
    }
  }
}

template <bool kCarving>
HWY_INLINE void ProjectVoxels(const ProjectionScan& scan, const ProjectionTask& task, Tally& tally) {
  const Constants c(scan);
  Selection selection;
  Select<kCarving>(scan, c, task, selection);
  for (int at = 0; at < selection.count; ++at) UpdateVector<kCarving>(scan, c, task, selection, at, tally);
  UpdateColors(scan, c, task, selection, tally);
}

VolumeUpdate ProjectVolume(const ProjectionScan& scan, const ProjectionTask& task) {
  Tally tally;
  if (scan.carving_factor > 0 && task.may_carve)
    ProjectVoxels<true>(scan, task, tally);
  else
    ProjectVoxels<false>(scan, task, tally);
  const std::uint64_t xy = tally.changed_xy;
  const auto layer = [](bool touched, int bit) { return touched ? 1u << bit : 0u; };
  tally.update.border_layers = static_cast<std::uint8_t>(
      layer(xy & 0x0101010101010101u, 0) | layer(xy & 0x8080808080808080u, 1) | layer(xy & 0xffu, 2) |
      layer(xy >> 56u, 3) | layer(tally.z_layers & 1u, 4) | layer(tally.z_layers & 0x80u, 5));
  return tally.update;
}

const char* TargetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace hm
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hm {
HWY_EXPORT(ProjectVolume);
HWY_EXPORT(TargetName);
VolumeUpdate project_volume_simd(const ProjectionScan& scan, const ProjectionTask& task) {
  return HWY_DYNAMIC_DISPATCH(ProjectVolume)(scan, task);
}
const char* simd_target_name() { return HWY_DYNAMIC_DISPATCH(TargetName)(); }
}  // namespace hm
#endif
