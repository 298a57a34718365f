// Mixed pixels and depth edges, 16-bit vectors (Highway): compiled once per instruction set.
#include "hm/tsdf/projection/depth_edges.hpp"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hm/tsdf/projection/depth_edges.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hm {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Processes the inner columns in whole vectors, the last one overlapping; returns the first unprocessed
/// column.
std::size_t SortOutInnerColumns(const EdgeRule& rule, const DepthRows& rows, std::uint16_t* units,
                                std::uint16_t* edge) {
#if HWY_TARGET == HWY_SCALAR
  (void)rule, (void)rows, (void)units, (void)edge;
  return 1;
#else
  const hn::CappedTag<std::uint16_t, 32> d;
  using V = hn::Vec<decltype(d)>;
  const V zero = hn::Zero(d), quadratic = hn::Set(d, rule.quadratic), linear = hn::Set(d, rule.linear);
  const V constant = hn::Set(d, rule.constant);
  const std::size_t lanes = hn::Lanes(d);
  if (rows.width < lanes + 2) return 1;
  const std::size_t last = rows.width - 1 - lanes;
  for (std::size_t next = 1; next < last + lanes; next += lanes) {
    const std::size_t x = std::min(next, last);
    const V z = hn::LoadU(d, rows.row + x);
    const V threshold = hn::SaturatedAdd(
        hn::SaturatedAdd(hn::MulHigh(hn::MulHigh(z, z), quadratic), hn::MulHigh(z, linear)), constant);
    // Amount by which a neighbour is nearer or farther than the threshold; zero if it is not, or has no
    // reading.
    const auto nearer = [&](V n) HWY_ATTR {
      const V excess = hn::SaturatedSub(hn::SaturatedSub(z, n), threshold);
      return hn::IfThenZeroElse(hn::Eq(n, zero), excess);
    };
    const auto farther = [&](V n) HWY_ATTR { return hn::SaturatedSub(hn::SaturatedSub(n, z), threshold); };
    const V left = hn::LoadU(d, rows.row + x - 1), right = hn::LoadU(d, rows.row + x + 1);
    const V above = hn::LoadU(d, rows.above + x), below = hn::LoadU(d, rows.below + x);
    const V nl = nearer(left), nr = nearer(right), na = nearer(above), nb = nearer(below);
    const V fl = farther(left), fr = farther(right), fa = farther(above), fb = farther(below);
    // min(a, b) > 0: both; the or of such: any.
    const V mixed =
        hn::Or(hn::Or(hn::Min(nl, fr), hn::Min(fl, nr)), hn::Or(hn::Min(na, fb), hn::Min(fa, nb)));
    const V any = hn::Or(hn::Or(hn::Or(nl, nr), hn::Or(na, nb)), hn::Or(hn::Or(fl, fr), hn::Or(fa, fb)));
    hn::StoreU(hn::IfThenElseZero(hn::Eq(mixed, zero), z), d, units + x);
    hn::StoreU(hn::IfThenZeroElse(hn::Eq(any, zero), hn::Set(d, 0xffff)), d, edge + x);
  }
  return rows.width - 1;
#endif
}

}  // namespace HWY_NAMESPACE
}  // namespace hm
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hm {
HWY_EXPORT(SortOutInnerColumns);

EdgeRule::EdgeRule(const TsdfParams& params, const DepthNoise& noise, const PinholeCamera& camera,
                   double unit_m)
    : enabled(params.edge_filter) {
  const auto fixed = [](double value) {
    return static_cast<std::uint16_t>(std::lround(std::clamp(value, 0.0, 65535.0)));
  };
  const double sigmas = params.kEdgeSigmasRatio;
  quadratic = fixed(sigmas * noise.quadratic_per_m * unit_m * 65536.0 * 65536.0);
  linear = fixed((sigmas * noise.linear_ratio + params.kEdgeSlopeRatio / camera.fx) * 65536.0);
  constant = fixed(sigmas * noise.constant_m / unit_m);
}

namespace {

/// One pixel, by the definition.
void sort_out_pixel(const EdgeRule& rule, const DepthRows& rows, std::size_t x, std::uint16_t* units,
                    std::uint16_t* edge) {
  const int z = rows.row[x], threshold = rule.threshold(rows.row[x]);
  const auto step_to = [&](std::uint16_t neighbour) {
    if (neighbour == 0) return 0;
    const int step = neighbour - z;
    return step > threshold ? 1 : step < -threshold ? -1 : 0;
  };
  const int left = x > 0 ? step_to(rows.row[x - 1]) : 0,
            right = x + 1 < rows.width ? step_to(rows.row[x + 1]) : 0;
  const int above = step_to(rows.above[x]), below = step_to(rows.below[x]);
  units[x] = left * right < 0 || above * below < 0 ? std::uint16_t{0} : rows.row[x];
  edge[x] = left != 0 || right != 0 || above != 0 || below != 0 ? std::uint16_t{0xffff} : std::uint16_t{0};
}

}  // namespace

void sort_out_edges(const EdgeRule& rule, const DepthRows& rows, std::uint16_t* units, std::uint16_t* edge) {
  if (!rule.enabled) {
    std::copy_n(rows.row, rows.width, units);
    std::fill_n(edge, rows.width, std::uint16_t{0});
    return;
  }
  if (rows.width == 0) return;
  const std::size_t done =
      std::max<std::size_t>(1, HWY_DYNAMIC_DISPATCH(SortOutInnerColumns)(rule, rows, units, edge));
  sort_out_pixel(rule, rows, 0, units, edge);
  for (std::size_t x = done; x < rows.width; ++x) sort_out_pixel(rule, rows, x, units, edge);
}

}  // namespace hm
#endif
