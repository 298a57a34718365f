// Voxel projection with vectors: compiled once per instruction set, chosen at run time (Highway).
#include <hwy/cache_control.h>

#include "hm/tsdf/projection/projection_scan.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hm/tsdf/projection/projection_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "hm/sensors/vectors_inl.hpp"
#include "hm/tsdf/projection/projection_lookup_inl.hpp"
#include "hm/tsdf/update/discrete_update_filter_inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace hm {
namespace HWY_NAMESPACE {

/// Statistics of one volume so far.
struct Tally {
  std::uint64_t changed_xy = 0;  ///< any z: bit 8 y + x
  std::uint8_t z_layers = 0;
  VolumeUpdate update;
};

/// Selected vectors of a volume, with their looked-up data.
struct Selection {
  HWY_ALIGN float z[kVolumeVoxels];
  HWY_ALIGN float signed_depth[kVolumeVoxels];
  HWY_ALIGN std::int32_t pixel[kVolumeVoxels];
  HWY_ALIGN std::int32_t tile[kVolumeVoxels];  ///< for carving
  int first_voxel[kVolumeVoxels];
  int count = 0;
  int colored_at[kVolumeVoxels];  ///< indices of vectors that are coloured
  int colored_count = 0;
};

/// Marks the changed lanes of a vector.
HWY_INLINE void Note(MF changed, int first, Tally& tally) {
  const std::uint64_t bits = MaskBits(changed);
  if (bits == 0) return;
  tally.changed_xy |= bits << (first & 63);
  tally.z_layers = static_cast<std::uint8_t>(tally.z_layers | 1u << (first >> 6));
}

/// Observed distances in sdf units, clamped to the distance limit.
HWY_INLINE VF SampleOf(const Constants& c, const Comparison& l, MF wanted) {
  const VF units =
      hn::IfThenElseZero(wanted, hn::Mul(hn::Min(hn::Max(l.u, hn::Neg(c.limit)), c.limit), c.units_per_m));
  return hn::ConvertTo(DF(), hn::NearestInt(units));
}

/// Lanes on or behind a surface (an unknown voxel's distance is 0).
HWY_INLINE MF SolidLanes(VI bits) {
  return hn::RebindMask(DF(), hn::Lt(hn::ShiftLeft<16>(bits), hn::Set(DI(), 1)));
}

/// Second pass: observations for the vector at index `at` of the selection.
HWY_INLINE void ObserveVector(const ProjectionScan& scan, const Constants& c, const ProjectionTask& task,
                              Selection& selection, int at, Tally& tally) {
  const DF d;
  const DI di;
  const DU du;
  const int first = selection.first_voxel[at];
  const auto offset = at * static_cast<int>(hn::Lanes(d));
  const VF signed_depth = hn::Load(d, selection.signed_depth + offset);
  const Comparison l = Compare(c, signed_depth, hn::Load(d, selection.z + offset));
  auto* words = reinterpret_cast<std::int32_t*>(task.voxels) + first;
  const VI bits = hn::Load(di, words);
  const VI observed =
      AddObservation(bits, SampleOf(c, l, l.observed), WeightOf(c, signed_depth, l.tau), c.weight_cap);
  hn::Store(hn::IfThenElse(hn::RebindMask(di, l.observed), observed, bits), di, words);
  const MF solid = SolidLanes(observed), free = hn::AndNot(l.hit, l.observed);
  tally.update.interior_hit |= !hn::AllFalse(d, hn::And(l.hit, solid));
  tally.update.updated += static_cast<std::uint32_t>(hn::CountTrue(d, l.hit));
  tally.update.freed += static_cast<std::uint32_t>(hn::CountTrue(d, free));
  if (scan.carving_factor > 0) {
    const MF known = hn::RebindMask(d, hn::Ne(hn::ShiftRight<16>(hn::BitCast(du, bits)), hn::Zero(du)));
    const MF was_solid = hn::And(known, SolidLanes(bits));
    tally.update.carved +=
        static_cast<std::uint32_t>(hn::CountTrue(d, hn::And(free, hn::AndNot(solid, was_solid))));
  }
  Note(l.observed, first, tally);
  if (task.colors) {
    hwy::Prefetch(task.colors + first);
    selection.colored_at[selection.colored_count] = at;
    selection.colored_count += hn::AllFalse(d, ColorLanes(c, l)) ? 0 : 1;
  }
}

/// Second pass: carving.
HWY_INLINE void CarveVector(const ProjectionScan& scan, const Constants& c, const ProjectionTask& task,
                            const Selection& selection, int at, Tally& tally) {
  const DF d;
  const DI di;
  const int first = selection.first_voxel[at];
  const auto offset = at * static_cast<int>(hn::Lanes(d));
  const VF z = hn::Load(d, selection.z + offset), signed_depth = hn::Load(d, selection.signed_depth + offset);
  const Comparison l = Compare(c, signed_depth, z);
  auto* words = reinterpret_cast<std::int32_t*>(task.voxels) + first;
  const VI bits = hn::Load(di, words);
  const VF observation = WeightOf(c, signed_depth, l.tau);
  const MF stale = hn::And(l.beyond, StaleLanes(bits, scan.stale_below));
  // Solid voxels well in front of all readings of their tile lose weight; others are updated as free.
  const VF tile_min = hn::GatherIndex(d, scan.tile_min_m, hn::Load(di, selection.tile + offset));
  const MF inside = hn::And(StaleLanes(bits, 1), hn::Gt(hn::Sub(tile_min, z), hn::Add(l.tau, c.margin)));
  const MF carved = hn::And(stale, hn::Or(inside, l.in_range));
  const VF taken = hn::ConvertTo(d, hn::NearestInt(hn::Mul(observation, c.carving_factor)));
  const VI pushed = AddObservation(bits, SampleOf(c, l, l.beyond), observation, c.weight_cap);
  const VI less = hn::IfThenElse(hn::RebindMask(di, inside), TakeWeight(bits, taken), pushed);
  hn::Store(hn::IfThenElse(hn::RebindMask(di, carved), less, bits), di, words);
  tally.update.carved += static_cast<std::uint32_t>(hn::CountTrue(d, carved));
  Note(carved, first, tally);
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

HWY_INLINE VI LoadWords(const TsdfVoxel* voxels) {
  return hn::Load(DI(), reinterpret_cast<const std::int32_t*>(voxels));
}

/// Parts among `parts` with voxels that could be carved.
HWY_INLINE std::uint32_t StaleParts(const TsdfVoxel* voxels, std::uint32_t parts, std::int32_t below) {
  const DF d;
  std::uint32_t stale = 0;
  for (; parts != 0; parts &= parts - 1) {
    const auto part = hwy::Num0BitsBelowLS1Bit_Nonzero32(parts);
    for (std::size_t i = 0; i < 16; i += hn::Lanes(d))
      stale |=
          static_cast<std::uint32_t>(!hn::AllFalse(d, StaleLanes(LoadWords(voxels + 16 * part + i), below)))
          << part;
  }
  return stale;
}

/// First pass: looks up parts, so that memory latencies overlap, and appends those to be updated. True if a
/// voxel lies in the hit region.
template <bool kCarving>
HWY_INLINE bool Select(const ProjectionScan& scan, const Constants& c, const ProjectionTask& task,
                       std::uint32_t parts, Selection& selection) {
  const DF d;
  const DI di;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const Eigen::Vector3f origin = scan.origin_of(task.key);
  bool any_hit = false;
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
      bool kept = !hn::AllFalse(d, found.observed);
      any_hit |= !hn::AllFalse(d, found.hit);
      if constexpr (kCarving) {
        const VI tile = hn::Add(hn::Mul(hn::ShiftRight<3>(l.row), c.tiles_x), hn::ShiftRight<3>(l.column));
        hn::Store(tile, di, selection.tile + offset);
        kept = !hn::AllFalse(
            d, hn::And(found.beyond, StaleLanes(LoadWords(task.voxels + first), scan.stale_below)));
      }
      selection.first_voxel[selection.count] = first;
      selection.count += kept ? 1 : 0;
    }
  }
  return any_hit;
}

HWY_INLINE void ProjectVoxels(const ProjectionScan& scan, const ProjectionTask& task, Tally& tally) {
  const Constants c(scan);
  Selection selection;
  const std::uint32_t in_band = task.parts.in_band, in_front = task.parts.in_front & ~in_band;
  if (in_band != 0 && Select<false>(scan, c, task, in_band, selection)) {
    Select<false>(scan, c, task, in_front, selection);
    for (int at = 0; at < selection.count; ++at) ObserveVector(scan, c, task, selection, at, tally);
    UpdateColors(scan, c, task, selection, tally);
  } else if (scan.carving_factor > 0 && task.may_carve) {
    selection.count = 0;
    Select<true>(scan, c, task, StaleParts(task.voxels, in_band | in_front, scan.stale_below), selection);
    for (int at = 0; at < selection.count; ++at) CarveVector(scan, c, task, selection, at, tally);
  }
}

VolumeUpdate ProjectVolume(const ProjectionScan& scan, const ProjectionTask& task) {
  Tally tally;
  ProjectVoxels(scan, task, tally);
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
