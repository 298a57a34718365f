#pragma once
#include "hm/core/time.hpp"
#include "hm/sensors/rgbd_frame.hpp"

/// Small images for tests of cameras.
namespace hm::testing_frames {

inline constexpr int kWidth = 24, kHeight = 16;
inline const PinholeCamera kCamera{kWidth, kHeight, 20, 20, 11.5, 7.5, {}};

/// Image `number` of a camera: every pixel differs from that of the next images.
inline DepthImage depth_image(int number) {
  DepthImage depth{Image<std::uint16_t>(kWidth, kHeight), 1e-3};
  int pixel = 0;
  for (auto& units : depth.units.pixels()) units = static_cast<std::uint16_t>(1000 * (number + 1) + pixel++);
  return depth;
}

inline Image<Rgb8> color_image(int number) {
  Image<Rgb8> color(kWidth, kHeight);
  int pixel = 0;
  for (Rgb8& rgb : color.pixels())
    rgb = {static_cast<std::uint8_t>(number), static_cast<std::uint8_t>(pixel++), 3};
  return color;
}

/// Frame `number` at 30 Hz.
inline RgbdFrame frame(int number) {
  RgbdFrame frame;
  frame.stamp = frame.color_stamp = Time{1'000'000'000 + number * 33'333'333LL};
  frame.depth = depth_image(number);
  frame.color = color_image(number);
  return frame;
}

}  // namespace hm::testing_frames
