// The update filters of discrete_update_filter.hpp with Highway vectors, bit-identical. Included once per
// instruction set, hence the toggling include guard.
#if defined(HM_TSDF_DISCRETE_UPDATE_FILTER_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HM_TSDF_DISCRETE_UPDATE_FILTER_INL
#undef HM_TSDF_DISCRETE_UPDATE_FILTER_INL
#else
#define HM_TSDF_DISCRETE_UPDATE_FILTER_INL
#endif

#include <hwy/highway.h>

#include "hm/sensors/vectors_inl.hpp"
#include "hm/tsdf/update/discrete_update_filter.hpp"

HWY_BEFORE_NAMESPACE();
namespace hm {
namespace HWY_NAMESPACE {

/// Vector version of filter_step().
HWY_INLINE VF FilterStep(DF df, VF difference, VF gain, VF weight) {
  const VF step = hn::ConvertTo(df, hn::NearestInt(hn::Mul(difference, gain)));
  const VF one = hn::Set(df, 1.0f), least = hn::Set(df, 0.5f * kWeightOne), zero = hn::Zero(df);
  const VF weighted = hn::Mul(difference, weight);
  VF nudge = hn::IfThenElseZero(hn::Ge(weighted, least), one);
  nudge = hn::IfThenElse(hn::Le(weighted, hn::Neg(least)), hn::Neg(one), nudge);
  return hn::IfThenElse(hn::Eq(step, zero), nudge, step);
}

/// Vector version of add_observation() on voxels' bits.
HWY_INLINE VI AddObservation(VI bits, VF sample, VF observation, VF cap) {
  const DF d;
  const DI di;
  const DU du;
  const VF mean = hn::ConvertTo(d, hn::ShiftRight<16>(hn::ShiftLeft<16>(bits)));
  const VF old_weight = hn::ConvertTo(d, hn::BitCast(di, hn::ShiftRight<16>(hn::BitCast(du, bits))));
  const VF new_weight = hn::Add(old_weight, observation);
  const VF gain = hn::Div(observation, hn::Max(new_weight, hn::Set(d, 1.0f)));
  const VF moved = hn::Add(mean, FilterStep(d, hn::Sub(sample, mean), gain, observation));
  return hn::Or(hn::And(hn::ConvertTo(di, moved), hn::Set(di, 0xffff)),
                hn::ShiftLeft<16>(hn::ConvertTo(di, hn::Min(new_weight, cap))));
}

/// Vector version of take_weight() on voxels' bits.
HWY_INLINE VI TakeWeight(VI bits, VF taken) {
  const DF d;
  const DI di;
  const DU du;
  const VI weight = hn::BitCast(di, hn::ShiftRight<16>(hn::BitCast(du, bits)));
  const VF left = hn::Sub(hn::ConvertTo(d, weight), taken);
  const VI kept = hn::Or(hn::And(bits, hn::Set(di, 0xffff)), hn::ShiftLeft<16>(hn::ConvertTo(di, left)));
  return hn::IfThenElseZero(hn::RebindMask(di, hn::Gt(left, hn::Zero(d))), kept);
}

/// Mask of voxels that may be carved: known, with an sdf smaller than `below`.
HWY_INLINE MF StaleLanes(VI bits, std::int32_t below) {
  const DI di;
  const DU du;
  const auto known = hn::Ne(hn::ShiftRight<16>(hn::BitCast(du, bits)), hn::Zero(du));
  return hn::RebindMask(DF(),
                        hn::And(hn::RebindMask(di, known),
                                hn::Lt(hn::ShiftRight<16>(hn::ShiftLeft<16>(bits)), hn::Set(di, below))));
}

/// Colours of pixels, 3 bytes each, as red | green << 8 | blue << 16.
HWY_INLINE VU GatherRgb(DU du, const std::uint8_t* rgb, VI pixel) {
  const DI di;
  const VI offset = hn::Add(hn::Add(pixel, pixel), pixel);
#if HWY_TARGET <= HWY_AVX2 && HWY_TARGET >= HWY_AVX3_DL
  const VI packed = hn::GatherOffset(di, reinterpret_cast<const std::int32_t*>(rgb), offset);
  return hn::And(hn::BitCast(du, packed), hn::Set(du, 0xffffffu));
#else
  HWY_ALIGN std::int32_t offsets[16];
  HWY_ALIGN std::uint32_t colors[16];
  hn::Store(offset, di, offsets);
  for (std::size_t i = 0; i < hn::Lanes(du); ++i) {
    const std::uint8_t* p = rgb + offsets[i];
    colors[i] = static_cast<std::uint32_t>(p[0]) | static_cast<std::uint32_t>(p[1]) << 8u |
                static_cast<std::uint32_t>(p[2]) << 16u;
  }
  return hn::Load(du, colors);
#endif
}

/// Vector version of add_color() for the lanes of `mask`: two 16-bit channels at a time.
#if HWY_TARGET == HWY_SCALAR  // one lane, which cannot be split
HWY_INLINE void AddColors(std::uint32_t* voxels, VU rgb, MF mask, std::uint32_t cap) {
  if (hn::AllTrue(DF(), mask)) *voxels = add_color({*voxels}, hn::GetLane(rgb), cap).bits;
}
#else
HWY_INLINE void AddColors(std::uint32_t* voxels, VU rgb, MF mask, std::uint32_t cap) {
  const DF df;
  const DI di;
  const DU du;
  const hn::Repartition<std::int16_t, DU> d16;
  const VU old = hn::Load(du, voxels);
  const VU one = hn::Set(du, 1), even = hn::Set(du, 0x00ff00ffu);
  const VU next_weight = hn::Add(hn::ShiftRight<24>(old), one);
  const VI gain =
      hn::NearestInt(hn::Div(hn::Set(df, 16384.0f), hn::ConvertTo(df, hn::BitCast(di, next_weight))));
  const auto gains = hn::BitCast(d16, hn::Or(gain, hn::ShiftLeft<16>(gain)));
  const auto unit = hn::Set(d16, 1);
  const auto moved = [&](VU from_old, VU from_new) HWY_ATTR {
    const auto mean = hn::BitCast(d16, hn::And(from_old, even));
    const auto difference = hn::Sub(hn::BitCast(d16, hn::And(from_new, even)), mean);
    const auto step = hn::MulFixedPoint15(hn::Add(difference, difference), gains);
    const auto nudge = hn::Max(hn::Min(difference, unit), hn::Neg(unit));
    return hn::BitCast(du, hn::Add(mean, hn::IfThenElse(hn::Eq(step, hn::Zero(d16)), nudge, step)));
  };
  const VU red_blue = moved(old, rgb);
  const VU green = hn::And(moved(hn::ShiftRight<8>(old), hn::ShiftRight<8>(rgb)), hn::Set(du, 0xffu));
  const VU weight = hn::ShiftLeft<24>(hn::Min(next_weight, hn::Set(du, cap)));
  const VU bits = hn::Or(hn::Or(red_blue, hn::ShiftLeft<8>(green)), weight);
  hn::Store(hn::IfThenElse(hn::RebindMask(du, mask), bits, old), du, voxels);
}
#endif

}  // namespace HWY_NAMESPACE
}  // namespace hm
HWY_AFTER_NAMESPACE();
#endif
