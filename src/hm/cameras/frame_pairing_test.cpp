#include "hm/cameras/frame_pairing.hpp"

#include <gtest/gtest.h>

#include "hm/cameras/testing/testing_frames.hpp"

namespace hm {
namespace {

using testing_frames::color_image;
using testing_frames::depth_image;

constexpr Time at_ms(std::int64_t ms) { return Time{ms * 1'000'000}; }
constexpr Duration kHalf{16'667'000};

TEST(FramePairing, TheNearestColourImageIsTaken) {
  FramePairing pairing(kHalf);
  pairing.add_color(at_ms(90), color_image(1));
  pairing.add_depth(at_ms(100), depth_image(7));
  EXPECT_FALSE(pairing.take()) << "a nearer one may come";
  pairing.add_color(at_ms(104), color_image(2));
  const auto frame = pairing.take();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->color_stamp, at_ms(104));
  EXPECT_EQ(frame->color(0, 0).r, 2);
  EXPECT_EQ(frame->depth.units(0, 0), depth_image(7).units(0, 0));
  EXPECT_FALSE(pairing.take());
}

TEST(FramePairing, AColourImageIsUsedOnce) {
  FramePairing pairing(kHalf);
  pairing.add_depth(at_ms(100), depth_image(0));
  pairing.add_depth(at_ms(110), depth_image(1));
  pairing.add_color(at_ms(105), color_image(1));
  EXPECT_EQ(pairing.take()->color_stamp, at_ms(105));
  pairing.add_color(at_ms(140), color_image(2));
  const auto second = pairing.take();
  ASSERT_TRUE(second);
  EXPECT_TRUE(second->color.empty()) << "30 ms apart";
}

TEST(FramePairing, WithoutColourDepthImagesDoNotWaitForever) {
  FramePairing pairing(kHalf);
  int taken = 0;
  for (int i = 0; i < 20; ++i) {
    pairing.add_depth(at_ms(100 + 33 * i), depth_image(i));
    while (const auto frame = pairing.take()) {
      EXPECT_TRUE(frame->color.empty());
      EXPECT_EQ(frame->stamp, at_ms(100 + 33 * taken));
      ++taken;
    }
  }
  EXPECT_EQ(taken, 17) << "three wait";
}

/// A device whose colour comes later than its depth by a constant: every depth image has its own one.
TEST(FramePairing, AConstantDelayPairsAll) {
  FramePairing pairing(kHalf);
  int taken = 0;
  for (int i = 0; i < 30; ++i) {
    pairing.add_depth(at_ms(33 * i), depth_image(i));
    pairing.add_color(at_ms(33 * i + 12), color_image(i));
    while (const auto frame = pairing.take()) {
      ASSERT_FALSE(frame->color.empty()) << i;
      EXPECT_EQ(frame->color(0, 0).r, taken);
      ++taken;
    }
  }
  EXPECT_EQ(taken, 30);
}

TEST(DeviceClock, KeepsDifferencesAndStaysBehindWhatWasBefore) {
  DeviceClock clock;
  const Time first = clock.to_time(Duration{5'000});
  EXPECT_GT(first.seconds(), 1.6e9) << "the clock of this computer";
  EXPECT_EQ((clock.to_time(Duration{5'000 + 33'000'000}) - first).ns, 33'000'000);
  const Time future{first.ns + 3'600'000'000'000};
  DeviceClock later(future);
  EXPECT_GT(later.to_time(Duration{0}), future);
}

}  // namespace
}  // namespace hm
