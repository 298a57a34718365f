#include "hm/depth_camera/depth_kernels.hpp"

#include <algorithm>
#include <array>

#include "hm/core/round_up.hpp"

namespace hm::detail {
namespace {

/// One reading: its polynomial, rounded, 0 kept. Limits are whole numbers: compilers make better code of
/// those.
template <int kTerms>
[[gnu::always_inline]] inline std::uint16_t corrected(int units, float s, const float* c, float units_per_m) {
  float delta = c[kTerms - 1];
  for (int k = kTerms - 2; k >= 0; --k) delta = delta * s + c[k];
  int value = static_cast<int>(static_cast<float>(units) + delta * units_per_m + 0.5F);
  value = std::max(value, 1);
  value = std::min(value, 65535);
  return static_cast<std::uint16_t>(value &
                                    -static_cast<int>(units != 0));  // a branch would keep it from vectors
}

template <int kTerms>
[[gnu::always_inline]] inline void correct_row(std::uint16_t* units, int width, const RowTerms& row,
                                               const RowScale& scale) {
  for (int x = 0; x < width; ++x) {
    float s = static_cast<float>(units[x]) * scale.s_factor + scale.s_offset;
    s = s < row.low[x] ? row.low[x] : s;
    s = s > row.high[x] ? row.high[x] : s;
    float c[kTerms];
    for (int k = 0; k < kTerms; ++k) c[k] = row.term[k][x];
    units[x] = corrected<kTerms>(units[x], s, c, scale.units_per_m);
  }
}

/// Readings of one span of columns, in whole blocks: beyond `count` up to a block more is read and written.
/// cubic[4 k + p] is the factor of t^p of term k; t = t0 + i step.
template <int kTerms>
[[gnu::always_inline]] inline void correct_span(const std::uint16_t* __restrict from,
                                                std::uint16_t* __restrict to, const SpanShape& span,
                                                const float* __restrict cubic, const RowScale& scale) {
  const int count = round_up(span.count, kBlock);
#pragma GCC ivdep
  for (int i = 0; i < count; ++i) {
    const float t = span.t0 + static_cast<float>(i) * span.step;
    float c[kTerms];
    for (int k = 0; k < kTerms; ++k)
      c[k] = ((cubic[4 * k + 3] * t + cubic[4 * k + 2]) * t + cubic[4 * k + 1]) * t + cubic[4 * k];
    const int units = from[i];
    const int held = std::min(std::max(units, scale.lowest), scale.highest);
    const float s = static_cast<float>(held) * scale.s_factor + scale.s_offset;
    to[i] = corrected<kTerms>(units, s, c, scale.units_per_m);
  }
}

#define HM_DEPTH_KERNELS(name, attribute)                                                                  \
  template <int kTerms>                                                                                    \
  attribute void row_##name(std::uint16_t* units, int width, const RowTerms& row, const RowScale& scale) { \
    correct_row<kTerms>(units, width, row, scale);                                                         \
  }                                                                                                        \
  template <int kTerms>                                                                                    \
  attribute void span_##name(const std::uint16_t* from, std::uint16_t* to, const SpanShape& span,          \
                             const float* cubic, const RowScale& scale) {                                  \
    correct_span<kTerms>(from, to, span, cubic, scale);                                                    \
  }                                                                                                        \
  constexpr std::array<Kernels, 4> kKernels_##name{                                                        \
      Kernels{row_##name<1>, span_##name<1>}, Kernels{row_##name<2>, span_##name<2>},                      \
      Kernels{row_##name<3>, span_##name<3>}, Kernels{row_##name<4>, span_##name<4>}};

HM_DEPTH_KERNELS(plain, )
#if defined(__x86_64__)
HM_DEPTH_KERNELS(avx2, __attribute__((target("avx2"))))
HM_DEPTH_KERNELS(avx512,
                 __attribute__((target("avx512f,avx512bw,avx512dq,avx512vl,prefer-vector-width=512"))))
#endif

}  // namespace

const Kernels& kernels_for(int terms) {
  const auto index = static_cast<std::size_t>(terms - 1);
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl"))
    return kKernels_avx512[index];
  if (__builtin_cpu_supports("avx2")) return kKernels_avx2[index];
#endif
  return kKernels_plain[index];
}

}  // namespace hm::detail
