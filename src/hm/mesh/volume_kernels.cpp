// The vectorised steps of marching_cubes.cpp, compiled once per instruction set.
#include "hm/mesh/volume_mesh.hpp"
#include "hm/mesh/volume_scratch.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hm/mesh/volume_kernels.cpp"
#include "hwy/foreach_target.h"
// After foreach_target.
#include "hm/sensors/vectors_inl.hpp"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace hm::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using Scratch = VolumeScratch;
using D16 = hn::CappedTag<std::int16_t, 16>;

/// Loads the distances of eight voxels of a row, unknown where the weight is too small.
HWY_INLINE void LoadEight(const TsdfVoxel* from, std::int32_t min_weight, std::int16_t* to) {
  const hn::CappedTag<std::int32_t, 8> d;
  const hn::RebindToUnsigned<decltype(d)> du;
  const hn::Rebind<std::int16_t, decltype(d)> d16;
  for (std::size_t x = 0; x < 8; x += hn::Lanes(d)) {
    const auto voxel = hn::LoadU(du, &from[x].bits);
    const auto weight = hn::BitCast(d, hn::ShiftRight<16>(voxel));
    auto sdf = hn::ShiftRight<16>(hn::BitCast(d, hn::ShiftLeft<16>(voxel)));
    sdf = hn::Max(sdf, hn::Set(d, Scratch::kUnknown + 1));
    const auto too_light = hn::Lt(weight, hn::Set(d, min_weight));
    hn::StoreU(hn::DemoteTo(d16, hn::IfThenElse(too_light, hn::Set(d, Scratch::kUnknown), sdf)), d16, to + x);
  }
}

/// Row (y, z) of the field, y and z in -1..9: x = 0..7 and, from the next volume, 8..15.
HWY_INLINE void LoadFieldRow(const Neighborhood& around, std::int32_t min_weight, int y, int z, Scratch& s) {
  const int offset = voxel_offset(0, y & 7, z & 7);
  const int place = Neighborhood::at(0, y >> 3, z >> 3);
  std::int16_t* row = s.field + Scratch::field_at(0, y, z);
  LoadEight(around.voxels[place] + offset, min_weight, row);
  LoadEight(around.voxels[place + 1] + offset, min_weight, row + 8);
}

HWY_INLINE unsigned MaskBits(hn::Mask<D16> mask) {
  std::uint8_t bytes[8] = {};  // of which one or two are written
  hn::StoreMaskBits(D16(), mask, bytes);
  return bytes[0] | static_cast<unsigned>(bytes[1]) << 8u;
}

void LoadField(const Neighborhood& around, std::uint16_t min_weight, Scratch& s) {
  const D16 d;
  for (int z = 0; z < cells::kSide; ++z)
    for (int y = 0; y < cells::kSide; ++y) LoadFieldRow(around, min_weight, y, z, s);
  // In a second loop: reading a row wider than it was written stalls while the write is recent (store
  // forwarding).
  s.inside.clear();
  for (int z = 0; z < cells::kSide; ++z)
    for (int y = 0; y < cells::kSide; ++y) {
      const std::int16_t* row = s.field + Scratch::field_at(0, y, z);
      unsigned observed = 0, inside = 0;
      for (std::size_t x = 0; x < 16; x += hn::Lanes(d)) {
        const auto f = hn::LoadU(d, row + x);
        observed |= MaskBits(hn::Ne(f, hn::Set(d, Scratch::kUnknown))) << x;
        inside |= MaskBits(hn::Lt(f, hn::Zero(d))) << x;
      }
      const int r = cells::row_of(y, z);
      s.observed[r] = static_cast<std::uint16_t>(observed);
      s.inside[r] = static_cast<std::uint16_t>(inside);
    }
}

void LoadMargin(const Neighborhood& around, std::uint16_t min_weight, Scratch& s) {
  for (int i = 0; i < cells::kSide; ++i)
    for (const int outer : {-1, 9}) {
      LoadFieldRow(around, min_weight, outer, i, s);
      LoadFieldRow(around, min_weight, i, outer, s);
    }
  for (int z = 0; z < cells::kSide; ++z)
    for (int y = 0; y < cells::kSide; ++y) {
      const TsdfVoxel* plane = around.voxels[Neighborhood::at(-1, y >> 3, z >> 3)];
      const TsdfVoxel voxel = plane[voxel_offset(7, y & 7, z & 7)];
      const std::int16_t sdf = voxel.sdf() == Scratch::kUnknown ? Scratch::kUnknown + 1 : voxel.sdf();
      s.field[Scratch::field_at(-1, y, z)] = voxel.weight() >= min_weight ? sdf : Scratch::kUnknown;
    }
}

/// Difference over two voxels along one axis; twice the one-sided difference where only one side is known.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Difference(D d, const std::int16_t* center, int step, V f) {
  const auto unknown = hn::Set(d, Scratch::kUnknown);
  const auto before = hn::LoadU(d, center - step), after = hn::LoadU(d, center + step);
  const auto no_before = hn::Eq(before, unknown), no_after = hn::Eq(after, unknown);
  const auto difference =
      hn::SaturatedSub(hn::IfThenElse(no_after, f, after), hn::IfThenElse(no_before, f, before));
  return hn::IfThenElse(hn::Or(no_before, no_after), hn::SaturatedAdd(difference, difference), difference);
}

void MakeRecords(Scratch& s) {
  const D16 d;
  for (int z = 0; z < cells::kSide; ++z)
    for (int y = 0; y < cells::kSide; ++y) {
      const int r = cells::row_of(y, z);
      if ((s.cubes[r] | s.cubes[r - 1] | s.cubes[r - 9] | s.cubes[r - 10]) == 0) continue;
      for (std::size_t x = 0; x < 16; x += hn::Lanes(d)) {
        const std::int16_t* center = s.field + Scratch::field_at(0, y, z) + x;
        const auto f = hn::LoadU(d, center);
        const auto gx = Difference(d, center, 1, f);
        const auto gy = Difference(d, center, Scratch::kFieldStride, f);
        const auto gz = Difference(d, center, Scratch::kFieldStride * Scratch::kFieldSide, f);
        hn::StoreInterleaved4(gx, gy, gz, f, d, s.records + 4 * (static_cast<std::size_t>(r) * 16 + x));
      }
    }
}

/// One end of some edges as floats.
struct Ends {
  VF x, y, z, f;
  explicit HWY_INLINE Ends(const std::int16_t* records) {
    const hn::Rebind<std::int16_t, DF> d16;
    hn::Vec<decltype(d16)> rx, ry, rz, rf;
    hn::LoadInterleaved4(d16, records, rx, ry, rz, rf);
    x = ToFloat(rx), y = ToFloat(ry), z = ToFloat(rz), f = ToFloat(rf);
  }
  template <class V16>
  static HWY_INLINE VF ToFloat(V16 v) {
    return hn::ConvertTo(DF(), hn::PromoteTo(DI(), v));
  }
};

HWY_INLINE VF Blend(VF a, VF b, VF t) { return hn::Add(a, hn::Mul(hn::Sub(b, a), t)); }

/// Octahedral code of the direction (x, y, z); 0 (+z) for the zero vector.
HWY_INLINE VI PackNormal(VF x, VF y, VF z) {
  const DF d;
  const auto zero = hn::Zero(d), full = hn::Set(d, 127.0F);
  auto length = hn::Add(hn::Add(hn::Abs(x), hn::Abs(y)), hn::Abs(z));
  length = hn::IfThenElse(hn::Eq(length, zero), hn::Set(d, 1.0F), length);
  const auto scale = hn::Div(full, length);
  const auto u = hn::Mul(x, scale), v = hn::Mul(y, scale);
  const auto lower = hn::Lt(z, zero);
  const auto u_folded = hn::IfThenElse(lower, hn::CopySign(hn::Sub(full, hn::Abs(v)), u), u);
  const auto v_folded = hn::IfThenElse(lower, hn::CopySign(hn::Sub(full, hn::Abs(u)), v), v);
  const auto byte = hn::Set(DI(), 0xff);
  return hn::Or(hn::And(hn::NearestInt(u_folded), byte),
                hn::ShiftLeft<8>(hn::And(hn::NearestInt(v_folded), byte)));
}

/// Blends the colours (red lowest, weight highest) of two ends, t in 1/256; an end without weight is ignored.
HWY_INLINE VU BlendColors(VU a, VU b, VU t) {
  const DU d;
  const auto none = hn::Zero(d), half = hn::Set(d, 0x800080);
  const auto has_a = hn::Ne(hn::ShiftRight<24>(a), none), has_b = hn::Ne(hn::ShiftRight<24>(b), none);
  const auto from = hn::IfThenElse(has_a, a, b), to = hn::IfThenElse(has_b, b, a);
  const auto rest = hn::Sub(hn::Set(d, 256), t);
  const auto red_blue = hn::Set(d, 0xff00ff), green = hn::Set(d, 0xff00);
  const auto rb = hn::ShiftRight<8>(
      hn::Add(hn::Add(hn::Mul(hn::And(from, red_blue), rest), hn::Mul(hn::And(to, red_blue), t)), half));
  const auto from_g = hn::ShiftRight<8>(hn::And(from, green)), to_g = hn::ShiftRight<8>(hn::And(to, green));
  const auto g = hn::Add(hn::Add(hn::Mul(from_g, rest), hn::Mul(to_g, t)), hn::Set(d, 0x80));
  const auto blended = hn::Or(hn::And(rb, red_blue), hn::And(g, green));
  const auto neutral = hn::Set(d, kNeutralColor.r * 0x10101u);
  return hn::IfThenElse(hn::Or(has_a, has_b), blended, neutral);
}

void FinishVertices(std::size_t count, bool with_colors, Scratch& s) {
  const DF d;
  const hn::Rebind<std::uint16_t, DF> du16;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const Ends a(s.end_records[0] + 4 * i), b(s.end_records[1] + 4 * i);
    const auto exact = hn::Div(a.f, hn::Sub(a.f, b.f));
    auto fraction = hn::NearestInt(hn::Mul(exact, hn::Set(d, 65536.0F)));
    fraction = hn::Min(hn::Max(fraction, hn::Set(DI(), kMinFraction)), hn::Set(DI(), 65536 - kMinFraction));
    hn::StoreU(hn::DemoteTo(du16, fraction), du16, s.fractions + i);
    const auto t = hn::Mul(hn::ConvertTo(d, fraction), hn::Set(d, 1.0F / 65536.0F));
    const auto code = PackNormal(Blend(a.x, b.x, t), Blend(a.y, b.y, t), Blend(a.z, b.z, t));
    hn::StoreU(hn::DemoteTo(du16, code), du16, s.normals + i);
    if (!with_colors) continue;
    const auto step = hn::ShiftRight<8>(hn::BitCast(DU(), fraction));
    const auto color =
        BlendColors(hn::LoadU(DU(), s.end_colors[0] + i), hn::LoadU(DU(), s.end_colors[1] + i), step);
    hn::StoreU(color, DU(), s.vertex_colors + i);
  }
}

}  // namespace hm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hm {

HWY_EXPORT(LoadField);
HWY_EXPORT(LoadMargin);
HWY_EXPORT(MakeRecords);
HWY_EXPORT(FinishVertices);

void load_field(const Neighborhood& around, std::uint16_t min_weight, VolumeScratch& scratch) {
  HWY_DYNAMIC_DISPATCH(LoadField)(around, min_weight, scratch);
}
void load_margin(const Neighborhood& around, std::uint16_t min_weight, VolumeScratch& scratch) {
  HWY_DYNAMIC_DISPATCH(LoadMargin)(around, min_weight, scratch);
}
void make_records(VolumeScratch& scratch) { HWY_DYNAMIC_DISPATCH(MakeRecords)(scratch); }
void finish_vertices(std::size_t count, bool with_colors, VolumeScratch& scratch) {
  HWY_DYNAMIC_DISPATCH(FinishVertices)(count, with_colors, scratch);
}

}  // namespace hm
#endif
