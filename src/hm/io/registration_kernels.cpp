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
inline constexpr std::uint32_t kWholeBits = 0x4b000000;
}  // namespace hm::detail
#endif

HWY_BEFORE_NAMESPACE();
namespace hm {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using DHalf = hn::Rebind<std::uint16_t, DF>;  // as many as there are floats

/// Rounded and less `zero`, or `beyond` for what is not within 0 and that (no number is not): the last bits
/// of the sum with 2^23.
HWY_INLINE VU Rounded(VF value, VU zero, VU beyond) {
  const VU bits = hn::BitCast(DU(), hn::Add(value, hn::Set(DF(), detail::kWhole)));
  return hn::Min(hn::Sub(bits, zero), beyond);
}

/// z (column + row) + origin, along one axis.
struct Axis {
  HWY_INLINE Axis(const detail::ProjectedRow& projected, int axis)
      : column(projected.of_column[axis]),
        row(hn::Set(DF(), projected.of_row[axis])),
        origin(hn::Set(DF(), projected.origin[axis])) {}
  HWY_INLINE VF At(int x, VF z) const {
    return hn::Add(hn::Mul(z, hn::Add(hn::Load(DF(), column + x), row)), origin);
  }
  const float* HWY_RESTRICT column;
  VF row, origin;
};

/// What is used over and over is in local variables, since stores would make the compiler load it anew.
void Step(const detail::RegistrationStep& step) {
  std::uint32_t* HWY_RESTRICT cells = step.placed.cells;
  std::uint16_t* HWY_RESTRICT nearness = step.placed.nearness;
  const std::uint16_t* HWY_RESTRICT depth = step.depth;
  const std::uint32_t* HWY_RESTRICT put_cells = step.splatted.cells;
  const std::uint16_t* HWY_RESTRICT put_nearness = step.splatted.nearness;
  std::uint16_t* HWY_RESTRICT nearest = step.nearest;
  const detail::ProjectedRow& row = step.projection;
  const Axis along_x(row, 0), along_y(row, 1), along_z(row, 2);
  const VU beyond_x = hn::Set(DU(), row.last_x), beyond_y = hn::Set(DU(), row.last_y);
  const VU stride = hn::Set(DU(), row.stride), none = hn::Set(DU(), std::uint32_t{detail::kNone});
  const VU zero = hn::Set(DU(), detail::kWholeBits), one = hn::Set(DU(), detail::kWholeBits + 1);
  const VU first = hn::Iota(DU(), 0);
  const auto project = [&](int x) HWY_ATTR {
    const VI units = hn::PromoteTo(DI(), hn::LoadU(DHalf(), depth + x));
    const VF z = hn::ConvertTo(DF(), units), pz = along_z.At(x, z);
    const VF inverse = hn::Div(hn::Set(DF(), 1.0F), pz);
    const VU u = Rounded(hn::Mul(along_x.At(x, z), inverse), zero, beyond_x);
    const VU v = Rounded(hn::Mul(along_y.At(x, z), inverse), zero, beyond_y);
    const auto is_hole = hn::Eq(hn::BitCast(DU(), units), hn::Zero(DU()));
    // Holes would all go to one cell, each waiting for the one before.
    const VU apart = hn::Add(first, hn::Set(DU(), static_cast<std::uint32_t>(x)));
    hn::Store(hn::IfThenElse(is_hole, apart, hn::Add(hn::Mul(v, stride), u)), DU(), cells + x);
    const VU nearer = hn::IfThenElse(is_hole, none, Rounded(pz, one, none));
    hn::Store(hn::DemoteTo(DHalf(), hn::BitCast(DI(), nearer)), DHalf(), nearness + x);
  };
  const auto put = [&](int i) HWY_ATTR {
    std::uint64_t at = put_cells[i];
    const std::uint32_t old = nearest[at], now = put_nearness[i];
    // Hides from the compiler that both addresses are one: it would compute it apart, which costs a sixth.
    asm("" : "+r"(at));
    nearest[at] = static_cast<std::uint16_t>(old < now ? old : now);
  };
  // Both halves of a row in turn: neighbours in the image often share a cell, and the second of them would
  // wait for the first.
  const int lanes = static_cast<int>(hn::Lanes(DF())), half = row.width / 2;
  for (int x = 0, k = 0; x < row.width; x += detail::kBlock_px, k += detail::kBlock_px / 2) {
    put(k), put(k + half), put(k + 1), put(k + 1 + half), put(k + 2), put(k + 2 + half);
    put(k + 3), put(k + 3 + half), put(k + 4), put(k + 4 + half), put(k + 5), put(k + 5 + half);
    put(k + 6), put(k + 6 + half), put(k + 7), put(k + 7 + half);
    for (int i = 0; i < detail::kBlock_px; i += lanes) project(x + i);
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
HWY_EXPORT(Step);
HWY_EXPORT(FillRow);

namespace detail {
namespace {

std::uint32_t rounded(float value, std::uint32_t zero, std::uint32_t beyond) {
  return std::min(std::bit_cast<std::uint32_t>(value + kWhole) - zero, beyond);
}

void project_plain(const ProjectedRow& row, const std::uint16_t* depth, const PlacedRow& to) {
  for (int x = 0; x < row.width; ++x) {
    float p[3];
    for (int i = 0; i < 3; ++i)
      p[i] = static_cast<float>(depth[x]) * (row.of_column[i][x] + row.of_row[i]) + row.origin[i];
    const float inverse = 1.0F / p[2];
    const std::uint32_t u = rounded(p[0] * inverse, kWholeBits, row.last_x);
    const std::uint32_t v = rounded(p[1] * inverse, kWholeBits, row.last_y);
    to.cells[x] = depth[x] == 0 ? static_cast<std::uint32_t>(x) : v * row.stride + u;
    to.nearness[x] = static_cast<std::uint16_t>(depth[x] == 0 ? kNone : rounded(p[2], kWholeBits + 1, kNone));
  }
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

void register_step_plain(const RegistrationStep& step) {
  for (int x = 0; x < step.projection.width; ++x) {
    std::uint16_t& cell = step.nearest[step.splatted.cells[x]];
    cell = std::min(cell, step.splatted.nearness[x]);
  }
  project_plain(step.projection, step.depth, step.placed);
}

void register_step_simd(const RegistrationStep& step) { HWY_DYNAMIC_DISPATCH(Step)(step); }

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
