#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hm/depth_camera/frame_calibration.hpp"

namespace hm {
namespace {

TEST(FrameCalibration, RawDisparityBecomesDepthBeforeAnythingElse) {
  RgbdCalibration calibration;
  calibration.depth_camera = PinholeCamera{160, 120, 145, 144, 79, 61, {0.05, -0.1, 0.001, 0, 0}};
  const auto without = FrameCalibration::make(calibration, 160, 120);
  calibration.disparity = DisparityModel{3.2, -0.0029};
  const auto with = FrameCalibration::make(calibration, 160, 120);
  ASSERT_TRUE(with && without);
  DepthImage raw{Image<std::uint16_t>(160, 120), 1e-3};
  for (std::size_t i = 0; i < raw.units.size(); ++i)
    raw.units.data()[i] = i % 7 == 0 ? 2047 : static_cast<std::uint16_t>(500 + i % 500);
  DepthImage depth = raw;
  for (std::uint16_t& pixel : depth.units.pixels())
    pixel = pixel == 2047
                ? std::uint16_t{0}
                : static_cast<std::uint16_t>(std::lround(1e3 * calibration.disparity->depth_m(pixel)));
  const Image<std::uint16_t> found = with->calibrate(raw).units, wanted = without->calibrate(depth).units;
  EXPECT_TRUE(std::ranges::equal(found.pixels(), wanted.pixels()));
  EXPECT_FALSE(std::ranges::equal(found.pixels(), without->calibrate(raw).units.pixels()));
}

}  // namespace
}  // namespace hm
