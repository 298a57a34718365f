// Registration of depth with vectors: compiled once per instruction set, chosen at run time (Highway).
#include "hm/depth_camera/registration_kernels.hpp"

#include <algorithm>
#include <bit>

#define HWY_WANT_AVX3_DL  // which has Compress for 16 bits
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hm/depth_camera/registration_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "hm/depth_camera/splat_inl.hpp"
#include "hm/sensors/vectors_inl.hpp"

#ifndef HM_IO_REGISTRATION_NUMBERS
#define HM_IO_REGISTRATION_NUMBERS
namespace hm::detail {
/// Two readings on both sides of a hole belong to one surface when they differ by no more than 3 % (2^-16).
inline constexpr std::uint16_t kSameSurface = 1966;
inline constexpr float kWhole = 8388608.0F;              // 2^23: a sum with it has no fraction
inline constexpr float kWholeClose = kWhole + 65536.0F;  // less a depth: its closeness
}  // namespace hm::detail
#endif

HWY_BEFORE_NAMESPACE();
namespace hm {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR  // has no vectors of half as many numbers of twice the size
bool Step(const detail::RegistrationStep& step) { return detail::register_step_plain(step); }
#else
/// Numbers whose lower halves count, of even and of odd pixels -> those of all.
HWY_INLINE V16 Interleaved(VF even, VF odd) {
  const auto upper = hn::ShiftLeft<16>(hn::BitCast(DU(), odd));
  return hn::OddEven(hn::BitCast(D16(), upper), hn::BitCast(D16(), even));
}

/// A ProjectedRow in registers.
class Projection {
 public:
  explicit HWY_INLINE Projection(const detail::ProjectedRow& row)
      : row_x_(hn::Set(DF(), row.row[0])),
        row_y_(hn::Set(DF(), row.row[1])),
        row_z_(hn::Set(DF(), row.row[2])),
        origin_x_(hn::Set(DF(), row.origin[0])),
        origin_y_(hn::Set(DF(), row.origin[1])),
        origin_z_(hn::Set(DF(), row.origin[2])),
        first_row_(hn::Set(DF(), detail::kWhole + row.first_row)),
        stride_(hn::Set(DF(), row.stride)) {}

  struct Place {
    VF cell, closeness;  ///< in the lower halves
  };
  /// `columns` are those of axis 0.
  HWY_INLINE Place Of(VF z, const float* columns) const {
    const VF whole = hn::Set(DF(), detail::kWhole);
    const VF pz = At(z, columns + 2 * detail::kBlock_px, row_z_, origin_z_);
    const VF inverse = hn::Div(hn::Set(DF(), 1.0F), pz);
    const VF u = hn::Add(hn::Mul(At(z, columns, row_x_, origin_x_), inverse), whole);
    const VF v = hn::Add(hn::Mul(At(z, columns + detail::kBlock_px, row_y_, origin_y_), inverse), whole);
    // Whole numbers: exact, fused or not.
    return {hn::MulAdd(hn::Sub(v, first_row_), stride_, u), hn::Sub(hn::Set(DF(), detail::kWholeClose), pz)};
  }

 private:
  static HWY_INLINE VF At(VF z, const float* column, VF row, VF origin) {
    return hn::Add(hn::Mul(z, hn::Add(hn::Load(DF(), column), row)), origin);
  }
  VF row_x_, row_y_, row_z_, origin_x_, origin_y_, origin_z_, first_row_, stride_;
};

/// What is used over and over is in local variables, since stores would make the compiler load it anew.
bool Step(const detail::RegistrationStep& step) {
  const std::uint16_t* HWY_RESTRICT depth = step.depth;
  const float* HWY_RESTRICT columns = step.projection.columns;
  std::uint16_t *HWY_RESTRICT cells = step.placed.cells, *HWY_RESTRICT closeness = step.placed.closeness;
  Splat splat(step.splatted, step.closest);
  const Projection projection(step.projection);
  const V16 lowest = hn::Set(D16(), step.projection.lowest);
  const V16 span = hn::Sub(hn::Set(D16(), step.projection.highest), lowest);
  V16 beyond = hn::Zero(D16());
  const auto place = [&](int x, const float* column) HWY_ATTR {
    const V16 units = hn::LoadU(D16(), depth + x);
    const auto is_beyond = hn::Gt(hn::Sub(units, lowest), span);
    beyond = hn::Max(beyond, hn::IfThenElseZero(is_beyond, units));
    const V16 other = hn::Max(hn::LoadU(D16(), depth + x + 1), lowest);
    const VI held = hn::BitCast(DI(), hn::IfThenElse(is_beyond, other, units));
    const VI even = hn::And(held, hn::Set(DI(), 0xffff));
    const VI odd = hn::BitCast(DI(), hn::ShiftRight<16>(hn::BitCast(DU(), held)));
    const auto a = projection.Of(hn::ConvertTo(DF(), even), column);
    const auto b = projection.Of(hn::ConvertTo(DF(), odd), column + detail::kBlock_px / 2);
    hn::Store(Interleaved(a.cell, b.cell), D16(), cells + x);
    const V16 close = Interleaved(a.closeness, b.closeness);
    hn::Store(hn::IfThenZeroElse(is_beyond, close), D16(), closeness + x);
  };
  const auto place_block = [&](int x) HWY_ATTR {
    const int lanes = static_cast<int>(hn::Lanes(D16()));
    const float* block = columns + static_cast<std::ptrdiff_t>(x) * 3;
    for (int i = 0; i < detail::kBlock_px; i += lanes) place(x + i, block + i / 2);
  };
  // Both halves of a row in turn: neighbours in the image often share a cell, and the second of them would
  // wait for the first.
  const int width = step.projection.width, half = width / 2;
  for (int x = 0; x < half; x += detail::kBlock_px) {
    splat.Put(x, half, 0);
    place_block(2 * x);
    splat.Put(x, half, 1);
    place_block(2 * x + detail::kBlock_px);
  }
  splat.Finish();
  return !hn::AllTrue(D16(), hn::Eq(beyond, hn::Zero(D16())));
}
#endif

HWY_INLINE V16 DepthAt(const std::uint16_t* cells) {
  return hn::Sub(hn::Zero(D16()), hn::LoadU(D16(), cells));
}

/// The mean of two readings that agree, where `value` is a hole (0). Holes agree with none but holes.
HWY_INLINE V16 Filled(V16 value, V16 a, V16 b) {
  const V16 mean = hn::AverageRound(a, b), apart = hn::Sub(hn::Max(a, b), hn::Min(a, b));
  const V16 allowed = hn::MulHigh(mean, hn::Set(D16(), detail::kSameSurface));
  const auto is_filled = hn::AndNot(hn::Gt(apart, allowed), hn::Eq(value, hn::Zero(D16())));
  return hn::IfThenElse(is_filled, mean, value);
}

/// Without branches: as good as every vector has a hole or has none, at random.
void FillRow(const detail::FilledRow& row, std::uint16_t* HWY_RESTRICT depth) {
  const int lanes = static_cast<int>(hn::Lanes(D16()));
  const auto filled = [&](int x) HWY_ATTR {
    const V16 value = Filled(DepthAt(row.cells + x), DepthAt(row.cells + x - 1), DepthAt(row.cells + x + 1));
    return Filled(value, DepthAt(row.above + x), DepthAt(row.below + x));
  };
  int x = 0;
  for (; x + lanes <= row.width; x += lanes) hn::StoreU(filled(x), D16(), depth + x);
  if (x == row.width) return;
  HWY_ALIGN std::uint16_t rest[hn::MaxLanes(D16())];
  hn::Store(filled(x), D16(), rest);
  std::copy_n(rest, row.width - x, depth + x);
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

/// One reading in cells, with 2^23 added: rounded.
struct Rounded {
  Rounded(const ProjectedRow& row, int x, std::uint16_t units) {
    float p[3];
    for (int i = 0; i < 3; ++i)
      p[i] = static_cast<float>(units) * (row.columns[column_at(x, i)] + row.row[i]) + row.origin[i];
    const float inverse = 1.0F / p[2];
    u = p[0] * inverse + kWhole, v = p[1] * inverse + kWhole, closeness = kWholeClose - p[2];
  }
  float u, v, closeness;
};

std::uint32_t bits_of(float value) { return std::bit_cast<std::uint32_t>(value); }

bool project_plain(const ProjectedRow& row, const std::uint16_t* depth, const PlacedRow& to) {
  bool some_beyond = false;
  for (int x = 0; x < row.width; ++x) {
    const bool is_beyond = depth[x] < row.lowest || depth[x] > row.highest;
    const Rounded at(row, x, is_beyond ? std::max(depth[x + 1], row.lowest) : depth[x]);
    to.cells[x] = static_cast<std::uint16_t>(bits_of((at.v - (kWhole + row.first_row)) * row.stride + at.u));
    to.closeness[x] = is_beyond ? kNone : static_cast<std::uint16_t>(bits_of(at.closeness));
    some_beyond = some_beyond || (is_beyond && depth[x] != 0);
  }
  return some_beyond;
}

std::uint16_t depth_at(const std::uint16_t* cell) { return static_cast<std::uint16_t>(0 - *cell); }

/// What fills a hole between two readings, or 0.
std::uint16_t between(std::uint16_t a, std::uint16_t b) {
  const unsigned mean = (static_cast<unsigned>(a) + b + 1) / 2;
  const unsigned apart = a > b ? static_cast<unsigned>(a - b) : static_cast<unsigned>(b - a);
  if (a == 0 || b == 0 || apart > (mean * kSameSurface >> 16)) return 0;
  return static_cast<std::uint16_t>(mean);
}

}  // namespace

PlacedReading place_plain(const ProjectedRow& row, int x, std::uint16_t units) {
  const Rounded at(row, x, units);
  const std::uint32_t zero = bits_of(kWhole), closeness = bits_of(at.closeness) - zero;
  return {bits_of(at.v) - zero, bits_of(at.u) - zero,
          closeness <= kClosest ? static_cast<std::uint16_t>(closeness) : kNone};
}

bool register_step_plain(const RegistrationStep& step) {
  for (int x = 0; x < step.projection.width; ++x) {
    std::uint16_t& cell = step.closest[step.splatted.cells[x]];
    cell = std::max(cell, step.splatted.closeness[x]);
  }
  return project_plain(step.projection, step.depth, step.placed);
}

bool register_step_simd(const RegistrationStep& step) { return HWY_DYNAMIC_DISPATCH(Step)(step); }

void fill_row_plain(const FilledRow& row, std::uint16_t* depth) {
  for (int x = 0; x < row.width; ++x) {
    const std::uint16_t* cell = row.cells + x;
    depth[x] = depth_at(cell);
    if (depth[x] == 0) depth[x] = between(depth_at(cell - 1), depth_at(cell + 1));
    if (depth[x] == 0) depth[x] = between(depth_at(row.above + x), depth_at(row.below + x));
  }
}

void fill_row_simd(const FilledRow& row, std::uint16_t* depth) { HWY_DYNAMIC_DISPATCH(FillRow)(row, depth); }

}  // namespace detail
}  // namespace hm
#endif
