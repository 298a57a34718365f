// Registration of depth with vectors: compiled once per instruction set, chosen at run time (Highway).
#include "hm/io/registration_kernels.hpp"

#include <algorithm>
#include <bit>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hm/io/registration_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "hm/sensors/vectors_inl.hpp"

#ifndef HM_IO_REGISTRATION_NUMBERS
#define HM_IO_REGISTRATION_NUMBERS
namespace hm::detail {
/// Two readings on both sides of a hole belong to one surface when they differ by no more than 3 % (2^-16).
inline constexpr std::uint16_t kSameSurface = 1966;
inline constexpr float kWhole = 8388608.0F;  // 2^23: a sum with it has no fraction
inline constexpr std::int32_t kWholeBits = 0x4b000000;
}  // namespace hm::detail
#endif

HWY_BEFORE_NAMESPACE();
namespace hm {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using DU16 = hn::Rebind<std::uint16_t, DF>;  // as many as there are floats

/// z (column + row) + origin
HWY_INLINE VF Along(const detail::ProjectedRow& row, int axis, int x, VF z) {
  const VF direction = hn::Add(hn::LoadU(DF(), row.of_column[axis] + x), hn::Set(DF(), row.of_row[axis]));
  return hn::Add(hn::Mul(z, direction), hn::Set(DF(), row.origin[axis]));
}

/// Held within 0 and `last` (no number becomes 0) and rounded: the last bits of the sum with 2^23.
HWY_INLINE VI Rounded(VF value, VF last) {
  const VF held = hn::Min(hn::Max(value, hn::Zero(DF())), last);
  return hn::BitCast(DI(), hn::Add(held, hn::Set(DF(), detail::kWhole)));
}

void ProjectRow(const detail::ProjectedRow& row, const std::uint16_t* HWY_RESTRICT depth,
                std::int32_t* HWY_RESTRICT cells, std::uint16_t* HWY_RESTRICT nearness) {
  const VF last_x = hn::Set(DF(), row.last_x), last_y = hn::Set(DF(), row.last_y);
  const VF last_z = hn::Set(DF(), 65536.0F), one = hn::Set(DF(), 1.0F);
  const VI stride = hn::Set(DI(), row.stride);
  // What 2^23 is as bits, in a cell's x and y.
  const auto bits = static_cast<std::uint32_t>(detail::kWholeBits);
  const VI offset =
      hn::Set(DI(), static_cast<std::int32_t>(bits * (static_cast<std::uint32_t>(row.stride) + 1)));
  const VI less = hn::Set(DI(), detail::kWholeBits + 1), all = hn::Set(DI(), 0xffff);
  for (int x = 0; x < row.width; x += static_cast<int>(hn::Lanes(DF()))) {
    const VF z = hn::ConvertTo(DF(), hn::PromoteTo(DI(), hn::LoadU(DU16(), depth + x)));
    const VF pz = Along(row, 2, x, z);
    const VF inverse = hn::Div(one, pz);
    const VI u = Rounded(hn::Mul(Along(row, 0, x, z), inverse), last_x);
    const VI v = Rounded(hn::Mul(Along(row, 1, x, z), inverse), last_y);
    hn::StoreU(hn::Sub(hn::Add(hn::Mul(v, stride), u), offset), DI(), cells + x);
    const VF kept = hn::IfThenZeroElse(hn::Eq(z, hn::Zero(DF())), pz);
    // 0 becomes the largest number of 16 bits.
    const VI nearer = hn::And(hn::Sub(Rounded(kept, last_z), less), all);
    hn::StoreU(hn::DemoteTo(DU16(), nearer), DU16(), nearness + x);
  }
}

using DRow = hn::CappedTag<std::uint16_t, 32>;
using VRow = hn::Vec<DRow>;

HWY_INLINE VRow DepthAt(const std::uint16_t* cells) {
  return hn::Add(hn::LoadU(DRow(), cells), hn::Set(DRow(), std::uint16_t{1}));
}

HWY_INLINE VRow Between(VRow a, VRow b) {
  const VRow mean = hn::AverageRound(a, b), apart = hn::Sub(hn::Max(a, b), hn::Min(a, b));
  const VRow allowed = hn::MulHigh(mean, hn::Set(DRow(), detail::kSameSurface));
  const auto is_hole = hn::Or(hn::Eq(hn::Min(a, b), hn::Zero(DRow())), hn::Gt(apart, allowed));
  return hn::IfThenZeroElse(is_hole, mean);
}

HWY_INLINE VRow Filled(const std::uint16_t* cells, int stride) {
  const VRow across = Between(DepthAt(cells - 1), DepthAt(cells + 1));
  const VRow along = Between(DepthAt(cells - stride), DepthAt(cells + stride));
  return hn::IfThenElse(hn::Eq(across, hn::Zero(DRow())), along, across);
}

void FillRow(const std::uint16_t* HWY_RESTRICT cells, int stride, int width,
             std::uint16_t* HWY_RESTRICT depth) {
  const int lanes = static_cast<int>(hn::Lanes(DRow()));
  for (int x = 0; x < width; x += lanes) {
    VRow value = DepthAt(cells + x);
    const auto is_hole = hn::Eq(value, hn::Zero(DRow()));
    if (!hn::AllFalse(DRow(), is_hole)) value = hn::IfThenElse(is_hole, Filled(cells + x, stride), value);
    if (x + lanes <= width) {
      hn::StoreU(value, DRow(), depth + x);
    } else {
      HWY_ALIGN std::uint16_t rest[32];
      hn::Store(value, DRow(), rest);
      std::copy_n(rest, width - x, depth + x);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace hm
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hm {
HWY_EXPORT(ProjectRow);
HWY_EXPORT(FillRow);

namespace detail {
namespace {

int rounded(float value, float last) {
  const float held = value > 0.0F ? std::min(value, last) : 0.0F;
  return std::bit_cast<std::int32_t>(held + kWhole) - kWholeBits;
}

std::uint16_t depth_at(const std::uint16_t* cell) { return static_cast<std::uint16_t>(*cell + 1); }

/// What fills a hole between two readings, or 0.
std::uint16_t between(std::uint16_t a, std::uint16_t b) {
  const unsigned mean = (static_cast<unsigned>(a) + b + 1) / 2;
  const unsigned apart = a > b ? static_cast<unsigned>(a - b) : static_cast<unsigned>(b - a);
  if (a == 0 || b == 0 || apart > (mean * kSameSurface >> 16)) return 0;
  return static_cast<std::uint16_t>(mean);
}

}  // namespace

void project_row_plain(const ProjectedRow& row, const std::uint16_t* depth, std::int32_t* cells,
                       std::uint16_t* nearness) {
  for (int x = 0; x < row.width; ++x) {
    float p[3];
    for (int i = 0; i < 3; ++i)
      p[i] = static_cast<float>(depth[x]) * (row.of_column[i][x] + row.of_row[i]) + row.origin[i];
    const float inverse = 1.0F / p[2];
    cells[x] = rounded(p[1] * inverse, row.last_y) * row.stride + rounded(p[0] * inverse, row.last_x);
    const int moved = depth[x] == 0 ? 0 : rounded(p[2], 65536.0F);
    nearness[x] = static_cast<std::uint16_t>(moved - 1);
  }
}

void project_row_simd(const ProjectedRow& row, const std::uint16_t* depth, std::int32_t* cells,
                      std::uint16_t* nearness) {
  HWY_DYNAMIC_DISPATCH(ProjectRow)(row, depth, cells, nearness);
}

void fill_row_plain(const std::uint16_t* cells, int stride, int width, std::uint16_t* depth) {
  for (int x = 0; x < width; ++x) {
    const std::uint16_t* cell = cells + x;
    depth[x] = depth_at(cell);
    if (depth[x] == 0) depth[x] = between(depth_at(cell - 1), depth_at(cell + 1));
    if (depth_at(cell) == 0 && depth[x] == 0)
      depth[x] = between(depth_at(cell - stride), depth_at(cell + stride));
  }
}

void fill_row_simd(const std::uint16_t* cells, int stride, int width, std::uint16_t* depth) {
  HWY_DYNAMIC_DISPATCH(FillRow)(cells, stride, width, depth);
}

}  // namespace detail
}  // namespace hm
#endif
