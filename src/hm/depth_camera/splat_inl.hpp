// A row's readings into their cells, with vectors (Highway). Included once per instruction set, which is why
// the guard toggles.
#if defined(HM_IO_SPLAT_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HM_IO_SPLAT_INL
#undef HM_IO_SPLAT_INL
#else
#define HM_IO_SPLAT_INL
#endif

#include <hwy/highway.h>

#include <bit>
#include <cstdint>
#include <cstring>

#include "hm/depth_camera/registration_kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace hm {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D16 = hn::CappedTag<std::uint16_t, 32>;
using V16 = hn::Vec<D16>;

/// Puts a row's readings into their cells.
class Splat {
 public:
  HWY_INLINE Splat(const detail::PlacedRow& row, std::uint16_t* closest)
      : cells_(row.cells), closeness_(row.closeness), closest_(closest), put_(closest) {
    // Hides from the compiler that both are one: it would compute every address apart, which costs a sixth.
    asm("" : "+r"(put_));
  }

  /// Call for every block of the first half with `turn` 0 and then 1, for that of the second half.
  HWY_INLINE void Put(int x, int half, int turn) {
#if HWY_TARGET <= HWY_AVX3_DL  // or better: their numbers are smaller
    PutRuns(x + turn * half);
#else
    PutEach(x + turn * half);
#endif
  }
  /// After the last block.
  HWY_INLINE void Finish() {
#if HWY_TARGET <= HWY_AVX3_DL
    PutRun(late_);
#endif
  }

 private:
  const std::uint16_t* HWY_RESTRICT cells_;
  const std::uint16_t* HWY_RESTRICT closeness_;
  std::uint16_t *closest_, *put_;

  HWY_INLINE void PutOne(std::ptrdiff_t i) const {
    const std::uint64_t at = cells_[i];
    const std::uint32_t old = closest_[at], now = closeness_[i];
    put_[at] = static_cast<std::uint16_t>(old > now ? old : now);
  }

  /// Both halves of a block in turn: neighbours often share a cell, and the second would wait for the first.
  HWY_INLINE void PutEach(std::ptrdiff_t x) const {
    HWY_UNROLL(16)
    for (int i = 0; i < detail::kBlock_px / 2; ++i) PutOne(x + i), PutOne(x + i + detail::kBlock_px / 2);
  }

#if HWY_TARGET <= HWY_AVX3_DL
  using Bits = std::uint32_t;
  static_assert(hn::MaxLanes(D16()) == detail::kBlock_px && detail::kBlock_px == 32);
  using M16 = hn::Mask<D16>;
  static HWY_INLINE Bits BitsOf(M16 mask) {
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(D16(), mask, bytes);
    Bits bits;
    std::memcpy(&bits, bytes, sizeof bits);
    return bits;
  }
  static HWY_INLINE M16 MaskOf(Bits bits) {
    std::uint8_t bytes[8] = {};
    std::memcpy(bytes, &bits, sizeof bits);
    return hn::LoadMaskBits(D16(), bytes);
  }

  /// Readings that go to one cell after the other, the first of them to `to`.
  struct Run {
    V16 closeness;
    Bits lanes;
    std::uint16_t* to;
  };
  static HWY_INLINE void PutRun(const Run& run) {
    // On these instruction sets Compress leaves 0 after them (splat_test.cpp). A mask would cost 4 % of the
    // whole calibration of a frame.
    const V16 readings = hn::Compress(run.closeness, MaskOf(run.lanes));
    hn::StoreU(hn::Max(readings, hn::LoadU(D16(), run.to)), D16(), run.to);
  }

  /// Surfaces go to one cell after the other, some of which take two readings. Where the surface ends another
  /// run begins; blocks of more than two, or of three readings to a cell, are put one by one.
  HWY_INLINE void PutRuns(std::ptrdiff_t x) {
    PutRun(late_);
    late_.lanes = 0;
    const V16 cells = hn::Load(D16(), cells_ + x), step = hn::Sub(cells, hn::LoadU(D16(), cells_ + x - 1));
    const Bits is_next = BitsOf(hn::Eq(step, hn::Set(D16(), std::uint16_t{1})));
    const Bits is_same = BitsOf(hn::Eq(step, hn::Zero(D16()))) & ~Bits{1};
    const Bits begins = ~(is_next | is_same) & ~Bits{1};
    if ((begins & (begins - 1)) | (is_same & (is_same >> 1))) return PutEach(x);
    const V16 closeness = hn::Load(D16(), closeness_ + x), next = hn::LoadU(D16(), closeness_ + x + 1);
    const V16 closer = hn::IfThenElse(MaskOf(is_same >> 1), hn::Max(closeness, next), closeness);
    const int length = std::countr_zero(begins);
    const Bits first = static_cast<Bits>((std::uint64_t{1} << length) - 1);
    PutRun({closer, ~is_same & first, closest_ + cells_[x]});
    late_ = {closer, ~is_same & ~first, closest_ + cells_[x + length % detail::kBlock_px]};
  }

  /// Of the block before: right after that's first one, it would wait for it to be written.
  Run late_ = {hn::Zero(D16()), 0, closest_};
#endif
};

}  // namespace HWY_NAMESPACE
}  // namespace hm
HWY_AFTER_NAMESPACE();
#endif
