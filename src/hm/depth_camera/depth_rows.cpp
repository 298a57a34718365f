// Vector code for rows of depth (Highway): compiled once per instruction set, selected at run time. Products
// and sums are rounded separately, so that every instruction set gives the same bits.
#include "hm/depth_camera/depth_rows.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hm/depth_camera/depth_rows.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hm {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::CappedTag<float, detail::kRowBlock>;
using DI = hn::RebindToSigned<DF>;
using DU16 = hn::Rebind<std::uint16_t, DF>;
using VF = hn::Vec<DF>;

void CorrectRow(const detail::CorrectionRow& given, const std::uint16_t* HWY_RESTRICT from,
                std::uint16_t* HWY_RESTRICT to) {
  const detail::CorrectionRow row = given;  // what is written cannot change a copy
  const DF f;
  const VF least = hn::Set(f, 1), most = hn::Set(f, 65535), half = hn::Set(f, 0.5F);
  for (int x = 0; x < row.columns; x += static_cast<int>(hn::Lanes(f))) {
    const VF reading = hn::ConvertTo(f, hn::PromoteTo(DI(), hn::LoadU(DU16(), from + x)));
    const VF free_s = hn::Add(hn::Mul(reading, hn::Set(f, row.s_factor)), hn::Set(f, row.s_offset));
    const VF s = hn::Min(hn::Max(free_s, hn::LoadU(f, row.lowest_s + x)), hn::LoadU(f, row.highest_s + x));
    VF sum = hn::Zero(f);
    for (int k = row.terms - 1; k >= 0; --k) {
      const auto weighted = [&](std::size_t i) HWY_ATTR {
        return hn::Mul(hn::LoadU(f, row.tables[i] + k * row.columns + x), hn::Set(f, row.weights[i]));
      };
      const VF term = hn::Add(hn::Add(weighted(0), weighted(1)), hn::Add(weighted(2), weighted(3)));
      sum = hn::Add(hn::Mul(sum, s), term);
    }
    const VF value = hn::Add(hn::Add(reading, hn::Mul(sum, hn::Set(f, row.units_per_m))), half);
    const VF corrected = hn::Min(hn::Max(value, least), most);
    const VF kept = hn::IfThenElseZero(hn::Ne(reading, hn::Zero(f)), corrected);
    hn::StoreU(hn::DemoteTo(DU16(), hn::ConvertTo(DI(), kept)), DU16(), to + x);
  }
}

void ProjectRow(const detail::ProjectedRow& given, const std::uint16_t* HWY_RESTRICT depth,
                std::int32_t* HWY_RESTRICT pixels, std::uint16_t* HWY_RESTRICT closeness) {
  const detail::ProjectedRow row = given;  // what is written cannot change a copy
  const DF f;
  const DI i;
  const VF zero = hn::Zero(f), half = hn::Set(f, 0.5F), one = hn::Set(f, 1), end_z = hn::Set(f, 65536);
  const VF end_u = hn::Set(f, static_cast<float>(row.width));
  const VF end_v = hn::Set(f, static_cast<float>(row.height));
  const auto width = hn::Set(i, row.width);
  const auto is_within = [](VF value, VF begin, VF end)
                             HWY_ATTR { return hn::And(hn::Ge(value, begin), hn::Lt(value, end)); };
  for (int x = 0; x < row.columns; x += static_cast<int>(hn::Lanes(f))) {
    const VF reading = hn::ConvertTo(f, hn::PromoteTo(i, hn::LoadU(DU16(), depth + x)));
    const auto coordinate = [&](std::size_t axis) HWY_ATTR {
      const VF direction = hn::Add(hn::LoadU(f, row.column[axis] + x), hn::Set(f, row.row[axis]));
      return hn::Add(hn::Mul(reading, direction), hn::Set(f, row.origin[axis]));
    };
    const VF depth_there = coordinate(2), inverse = hn::Div(one, depth_there);
    // Rounds to nearest by adding a half and truncating.
    const VF u = hn::Add(hn::Mul(coordinate(0), inverse), half);
    const VF v = hn::Add(hn::Mul(coordinate(1), inverse), half);
    const VF z = hn::Add(depth_there, half);
    const auto is_pixel = hn::And(is_within(u, zero, end_u), is_within(v, zero, end_v));
    const auto is_seen = hn::And(hn::And(is_pixel, is_within(z, one, end_z)), hn::Ne(reading, zero));
    // Values outside the image may be too large for integers.
    const auto whole = [&](VF value)
                           HWY_ATTR { return hn::ConvertTo(i, hn::IfThenElseZero(is_seen, value)); };
    const auto pixel = hn::Add(hn::Mul(whole(v), width), whole(u));
    const auto close = hn::Sub(hn::Set(i, 65536), whole(z));
    hn::StoreU(pixel, i, pixels + x);
    hn::StoreU(hn::DemoteTo(DU16(), hn::IfThenElseZero(hn::RebindMask(i, is_seen), close)), DU16(),
               closeness + x);
  }
}

void FillRow(const detail::FilledRow& given, int columns, std::uint16_t* HWY_RESTRICT depth) {
  const detail::FilledRow row = given;
  const hn::CappedTag<std::uint16_t, detail::kRowBlock> u16;
  using V = hn::Vec<decltype(u16)>;
  const V none = hn::Zero(u16), same_surface = hn::Set(u16, std::uint16_t{1966});  // 0.03 of 2^16
  const auto depth_at = [&](const std::uint16_t* at) HWY_ATTR { return hn::Sub(none, hn::LoadU(u16, at)); };
  const auto mean_of = [&](V a, V b) HWY_ATTR {
    const V mean = hn::AverageRound(a, b), apart = hn::Sub(hn::Max(a, b), hn::Min(a, b));
    // A reading and a missing one (0) always differ too much; the mean of two missing ones is 0.
    return hn::IfThenZeroElse(hn::Gt(apart, hn::MulHigh(mean, same_surface)), mean);
  };
  for (int x = 0; x < columns; x += static_cast<int>(hn::Lanes(u16))) {
    const V here = depth_at(row.here + x);
    const V across = mean_of(depth_at(row.here + x - 1), depth_at(row.here + x + 1));
    const V down = mean_of(depth_at(row.above + x), depth_at(row.below + x));
    const V fill = hn::IfThenElse(hn::Eq(across, none), down, across);
    hn::StoreU(hn::IfThenElse(hn::Eq(here, none), fill, here), u16, depth + x);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace hm
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hm {
HWY_EXPORT(CorrectRow);
HWY_EXPORT(ProjectRow);
HWY_EXPORT(FillRow);

namespace detail {

void correct_row(const CorrectionRow& row, const std::uint16_t* from, std::uint16_t* to) {
  HWY_DYNAMIC_DISPATCH(CorrectRow)(row, from, to);
}

void project_row(const ProjectedRow& row, const std::uint16_t* depth, std::int32_t* pixels,
                 std::uint16_t* closeness) {
  HWY_DYNAMIC_DISPATCH(ProjectRow)(row, depth, pixels, closeness);
}

void fill_row(const FilledRow& row, int columns, std::uint16_t* depth) {
  HWY_DYNAMIC_DISPATCH(FillRow)(row, columns, depth);
}

}  // namespace detail
}  // namespace hm
#endif
