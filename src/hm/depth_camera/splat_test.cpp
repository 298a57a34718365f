// What splat_inl.hpp relies on, for every instruction set that it does so on.
#include <gtest/gtest.h>

#include <cstring>

#include "hm/core/rng.hpp"

#define HWY_WANT_AVX3_DL
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hm/depth_camera/splat_test.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hm {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// How many numbers Compress leaves after those it was asked for, or that are not those.
int WrongNumbers([[maybe_unused]] std::uint32_t lanes, [[maybe_unused]] const std::uint16_t* from) {
  int wrong = 0;
#if HWY_TARGET <= HWY_AVX3_DL
  const hn::CappedTag<std::uint16_t, 32> tag;
  HWY_ALIGN std::uint16_t to[32];
  std::uint8_t bytes[8] = {};
  std::memcpy(bytes, &lanes, sizeof lanes);
  hn::Store(hn::Compress(hn::LoadU(tag, from), hn::LoadMaskBits(tag, bytes)), tag, to);
  int next = 0;
  for (int i = 0; i < 32; ++i)
    if (lanes >> i & 1) wrong += to[next++] != from[i] ? 1 : 0;
  while (next < 32) wrong += to[next++] != 0 ? 1 : 0;
#endif
  return wrong;
}

}  // namespace HWY_NAMESPACE
}  // namespace hm
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hm {
HWY_EXPORT(WrongNumbers);

namespace {

TEST(Splat, CompressLeavesNothingAfterTheNumbers) {
  Rng rng(1);
  for (std::int64_t left = hwy::SupportedTargets(); left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left & -left);
    if ((left & -left) <= HWY_AVX3_DL) RecordProperty(hwy::TargetName(left & -left), "compared");
    for (int round = 0; round < 1000; ++round) {
      std::uint16_t from[32];
      for (auto& number : from) number = static_cast<std::uint16_t>(1 + rng.below(65535));
      const auto lanes = static_cast<std::uint32_t>(rng.below(65536) << 16 | rng.below(65536)) >> round % 32;
      ASSERT_EQ(HWY_DYNAMIC_DISPATCH(WrongNumbers)(lanes, from), 0) << hwy::TargetName(left & -left);
    }
  }
  hwy::SetSupportedTargetsForTest(0);
}

}  // namespace
}  // namespace hm
#endif
