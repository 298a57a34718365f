// Highway vector types of floats and integers with equal lane counts. Included once per instruction set,
// hence the toggling include guard.
#if defined(HM_SENSORS_VECTORS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HM_SENSORS_VECTORS_INL
#undef HM_SENSORS_VECTORS_INL
#else
#define HM_SENSORS_VECTORS_INL
#endif

#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace hm {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::CappedTag<float, 16>;
using DI = hn::RebindToSigned<DF>;
using DU = hn::RebindToUnsigned<DF>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;
using VU = hn::Vec<DU>;
using MF = hn::Mask<DF>;

/// Bit mask with bit i set for lane i.
HWY_INLINE std::uint32_t MaskBits(MF mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(DF(), mask, bytes);
  return static_cast<std::uint32_t>(bytes[0]) | static_cast<std::uint32_t>(bytes[1]) << 8u;
}

}  // namespace HWY_NAMESPACE
}  // namespace hm
HWY_AFTER_NAMESPACE();
#endif
