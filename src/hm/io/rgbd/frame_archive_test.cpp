#include "hm/io/rgbd/frame_archive.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

/// Smooth depth with holes and jumps, colours with noise; every seed another one.
RgbdFrame make_frame(std::size_t index, int width, int height, std::uint64_t seed) {
  Rng rng(seed);
  RgbdFrame frame;
  frame.index = index;
  frame.stamp = Time::from_seconds(0.1 * static_cast<double>(index));
  frame.color_stamp = Time::from_seconds(0.1 * static_cast<double>(index) + 0.01);
  frame.depth.unit_m = 2e-4;
  frame.T_world_camera = SE3(so3_exp(Vec3(0.1, 0.2, -0.3)), Vec3(1, 2, 3));
  frame.depth.units = Image<std::uint16_t>(width, height);
  frame.color = Image<Rgb8>(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double hole = rng.uniform(0, 1);
      frame.depth.units(x, y) = hole < 0.1   ? std::uint16_t{0}
                                : hole < 0.2 ? std::uint16_t{65535}
                                             : static_cast<std::uint16_t>(2000 + 3 * x + y);
      frame.color(x, y) = {static_cast<std::uint8_t>(x + 3 * y), static_cast<std::uint8_t>(255 * hole),
                           static_cast<std::uint8_t>(200 - x)};
    }
  return frame;
}

void expect_same(const RgbdFrame& a, const RgbdFrame& b) {
  EXPECT_EQ(a.index, b.index);
  EXPECT_EQ(a.stamp, b.stamp);
  EXPECT_EQ(a.color_stamp, b.color_stamp);
  EXPECT_EQ(a.depth.unit_m, b.depth.unit_m);
  ASSERT_EQ(a.depth.width(), b.depth.width());
  ASSERT_EQ(a.color.width(), b.color.width());
  EXPECT_TRUE(std::ranges::equal(a.depth.units.pixels(), b.depth.units.pixels()));
  EXPECT_TRUE(std::ranges::equal(a.color.pixels(), b.color.pixels()));
  ASSERT_EQ(a.T_world_camera.has_value(), b.T_world_camera.has_value());
  if (a.T_world_camera) {
    EXPECT_EQ(a.T_world_camera->matrix(), b.T_world_camera->matrix());
  }
}

TEST(FrameArchive, GivesFramesAgainToTheBit) {
  FrameArchive archive(PinholeCamera{64, 48, 60, 60, 32, 24, {}});
  for (std::size_t i = 0; i < 8; ++i) {
    RgbdFrame frame = make_frame(i, i % 2 ? 64 : 1, i % 3 ? 48 : 7, i);
    if (i == 5) frame.color = {}, frame.T_world_camera.reset();
    ASSERT_TRUE(archive.keep(frame));
    const auto again = archive.read(i);
    ASSERT_TRUE(again) << to_string(again.error());
    expect_same(frame, *again);
    const auto depth = archive.read_depth(i);
    ASSERT_TRUE(depth) << to_string(depth.error());
    frame.color = {};
    expect_same(frame, *depth);
  }
  EXPECT_EQ(archive.frame_count(), 8u);
  EXPECT_EQ(archive.read(8).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(archive.read_depth(8).error().code, ErrorCode::kNotFound);
}

TEST(FrameArchive, KeepsSmoothPicturesInAFractionOfTheirSize) {
  const int width = 320, height = 240;
  RgbdFrame frame = make_frame(0, width, height, 1);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      frame.depth.units(x, y) = static_cast<std::uint16_t>(2000 + x + 2 * y);
      frame.color(x, y) = {static_cast<std::uint8_t>(x / 4), static_cast<std::uint8_t>(y / 2), 40};
    }
  FrameArchive archive(PinholeCamera{width, height, 300, 300, 160, 120, {}});
  ASSERT_TRUE(archive.keep(frame));
  EXPECT_LT(archive.bytes(), 5u * width * height / 20);
}

TEST(FrameArchive, RefusesWhatItsCapForbidsAndSaysSo) {
  FrameArchive archive(PinholeCamera{64, 48, 60, 60, 32, 24, {}}, 30'000);
  std::size_t kept = 0;
  while (archive.keep(make_frame(kept, 64, 48, kept))) ++kept;
  EXPECT_GT(kept, 0u);
  EXPECT_LT(kept, 10u);
  EXPECT_LE(archive.bytes(), 30'000u);
  const auto refused = archive.keep(make_frame(99, 64, 48, 99));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kOutOfMemory);
  EXPECT_NE(refused.error().message.find("30000"), std::string::npos) << refused.error().message;
  EXPECT_TRUE(archive.read(0));
  EXPECT_TRUE(archive.keep(make_frame(0, 64, 48, 0))) << "in the place of the old one";
}

TEST(FrameArchive, IsReadWhileFramesAreKept) {
  FrameArchive archive(PinholeCamera{64, 48, 60, 60, 32, 24, {}});
  ASSERT_TRUE(archive.keep(make_frame(0, 64, 48, 0)));
  const RgbdFrame first = make_frame(0, 64, 48, 0);
  std::jthread reader([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) expect_same(first, *archive.read(0));
  });
  for (std::size_t i = 1; i < 40; ++i) ASSERT_TRUE(archive.keep(make_frame(i, 64, 48, i)));
}

}  // namespace
}  // namespace hm
