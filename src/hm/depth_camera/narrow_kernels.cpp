// Depth correction with vectors: compiled once per instruction set, chosen at run time (Highway).
#include "hm/depth_camera/narrow_kernels.hpp"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hm/depth_camera/narrow_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hm {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D16 = hn::CappedTag<std::int16_t, 32>;
using DU16 = hn::RebindToUnsigned<D16>;
using V16 = hn::Vec<D16>;
using VU16 = hn::Vec<DU16>;

/// a b + c
HWY_INLINE V16 TimesPlus(V16 a, V16 b, V16 c) { return hn::Add(hn::MulFixedPoint15(a, b), c); }

/// A NarrowScale in registers.
struct Scale {
  explicit HWY_INLINE Scale(const detail::NarrowScale& scale)
      : lowest(hn::Set(DU16(), scale.lowest)),
        highest(hn::Set(DU16(), scale.highest)),
        raise(hn::Set(DU16(), scale.raise)),
        middle(hn::Set(DU16(), scale.middle)),
        stretch(hn::Set(D16(), scale.stretch)),
        to_units(hn::Set(D16(), scale.to_units)),
        lower(hn::Set(D16(), scale.lower)) {}
  VU16 lowest, highest, raise, middle;
  V16 stretch, to_units, lower;
};

HWY_INLINE V16 PlaceOf(const Scale& scale, VU16 units) {
  const VU16 held = hn::Min(hn::Max(units, scale.lowest), scale.highest);
  const V16 w = hn::BitCast(D16(), hn::Sub(hn::Mul(held, scale.raise), scale.middle));
  return TimesPlus(w, scale.stretch, w);
}

HWY_INLINE void StoreCorrected(const Scale& scale, VU16 units, V16 sum, std::uint16_t* to) {
  const V16 delta = hn::MulFixedPoint15(hn::MulFixedPoint15(sum, scale.to_units), scale.lower);
  const V16 sign = hn::Set(D16(), static_cast<std::int16_t>(-32768));
  // Readings less 2^15 are signed, and sums of those end at the ends of 16 bits.
  const V16 moved = hn::SaturatedAdd(hn::Xor(hn::BitCast(D16(), units), sign), delta);
  const VU16 value = hn::Max(hn::BitCast(DU16(), hn::Xor(moved, sign)), hn::Set(DU16(), std::uint16_t{1}));
  hn::StoreU(hn::IfThenElseZero(hn::Ne(units, hn::Zero(DU16())), value), DU16(), to);
}

/// The polynomial in s whose coefficients `term` gives.
template <int kTerms, class Term>
HWY_INLINE V16 SumOf(V16 s, Term&& term) {
  V16 sum = term(kTerms - 1);
  for (int k = kTerms - 2; k >= 0; --k) sum = TimesPlus(sum, s, term(k));
  return sum;
}

template <int kTerms>
HWY_INLINE void CorrectSpline(const detail::NarrowRow& row, const detail::NarrowScale& narrow,
                              const std::uint16_t* HWY_RESTRICT from, std::uint16_t* HWY_RESTRICT to) {
  const Scale scale(narrow);
  const V16 weight = hn::Set(D16(), row.weight);
  const std::int16_t* HWY_RESTRICT coefficients = row.coefficients;
  const int stride = row.stride;
  for (int x = 0; x < row.width; x += static_cast<int>(hn::Lanes(D16()))) {
    const VU16 units = hn::LoadU(DU16(), from + x);
    const V16 sum = SumOf<kTerms>(PlaceOf(scale, units), [&](int k) HWY_ATTR {
      const std::int16_t* at = coefficients + k * stride + x;
      const V16 before = hn::Load(D16(), at), after = hn::Load(D16(), at + kTerms * stride);
      return TimesPlus(weight, hn::Sub(after, before), before);
    });
    StoreCorrected(scale, units, sum, to + x);
  }
}

template <int kTerms>
HWY_INLINE void CorrectPixels(const detail::NarrowRow& row, const detail::NarrowScale& narrow,
                              const std::uint16_t* HWY_RESTRICT from, std::uint16_t* HWY_RESTRICT to) {
  const Scale scale(narrow);
  for (int x = 0; x < row.width; x += static_cast<int>(hn::Lanes(D16()))) {
    const VU16 units = hn::LoadU(DU16(), from + x);
    const V16 low = hn::LoadU(D16(), row.lowest_s + x), high = hn::LoadU(D16(), row.highest_s + x);
    const V16 s = hn::Min(hn::Max(PlaceOf(scale, units), low), high);
    const V16 sum = SumOf<kTerms>(
        s, [&](int k) HWY_ATTR { return hn::LoadU(D16(), row.coefficients + k * row.stride + x); });
    StoreCorrected(scale, units, sum, to + x);
  }
}

template <int kTerms>
HWY_INLINE void CorrectTerms(const detail::NarrowRow& row, const detail::NarrowScale& scale,
                             const std::uint16_t* from, std::uint16_t* to) {
  if (row.is_spline)
    CorrectSpline<kTerms>(row, scale, from, to);
  else
    CorrectPixels<kTerms>(row, scale, from, to);
}

void CorrectRow(const detail::NarrowRow& row, const detail::NarrowScale& scale, const std::uint16_t* from,
                std::uint16_t* to) {
  switch (row.terms) {
    case 1:
      return CorrectTerms<1>(row, scale, from, to);
    case 2:
      return CorrectTerms<2>(row, scale, from, to);
    case 3:
      return CorrectTerms<3>(row, scale, from, to);
    default:
      return CorrectTerms<4>(row, scale, from, to);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace hm
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hm {
HWY_EXPORT(CorrectRow);

namespace detail {
namespace {

/// a b 2^-15, rounded.
std::int16_t times(std::int16_t a, std::int16_t b) {
  return static_cast<std::int16_t>((static_cast<int>(a) * static_cast<int>(b) + 16384) >> 15);
}

/// Whole vectors overflow beyond the end of a row, where nothing is kept.
std::int16_t plus(std::int16_t a, std::int16_t b) { return static_cast<std::int16_t>(a + b); }

std::int16_t place_of(std::uint16_t units, const NarrowScale& scale) {
  const unsigned held = std::min(std::max(units, scale.lowest), scale.highest);
  const auto w = static_cast<std::int16_t>(static_cast<std::uint16_t>(held * scale.raise - scale.middle));
  return plus(w, times(w, scale.stretch));
}

std::uint16_t corrected(std::uint16_t units, std::int16_t sum, const NarrowScale& scale) {
  if (units == 0) return 0;
  const int delta = times(times(sum, scale.to_units), scale.lower);
  return static_cast<std::uint16_t>(std::clamp(units + delta, 1, 65535));
}

/// The polynomial in s whose coefficients `term` gives.
template <class Term>
std::int16_t sum_of(int terms, std::int16_t s, Term term) {
  std::int16_t sum = term(terms - 1);
  for (int k = terms - 2; k >= 0; --k) sum = plus(times(sum, s), term(k));
  return sum;
}

}  // namespace

void correct_row_plain(const NarrowRow& row, const NarrowScale& scale, const std::uint16_t* from,
                       std::uint16_t* to) {
  for (int x = 0; x < row.width; ++x) {
    std::int16_t s = place_of(from[x], scale);
    if (!row.is_spline) s = std::min(std::max(s, row.lowest_s[x]), row.highest_s[x]);
    const auto term = [&](int k) {
      const int at = k * row.stride + x;
      const std::int16_t c = row.coefficients[at];
      if (!row.is_spline) return c;
      const auto step = static_cast<std::int16_t>(row.coefficients[at + row.terms * row.stride] - c);
      return plus(times(row.weight, step), c);
    };
    to[x] = corrected(from[x], sum_of(row.terms, s, term), scale);
  }
}

void correct_row_simd(const NarrowRow& row, const NarrowScale& scale, const std::uint16_t* from,
                      std::uint16_t* to) {
  HWY_DYNAMIC_DISPATCH(CorrectRow)(row, scale, from, to);
}

}  // namespace detail
}  // namespace hm
#endif
