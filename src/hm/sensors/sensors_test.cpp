#include <gtest/gtest.h>

#include "hm/sensors/depth_noise.hpp"
#include "hm/sensors/rgbd_frame.hpp"
#include "hm/sensors/round_up.hpp"

namespace hm {
namespace {

TEST(DepthNoise, DefaultIsNguyenWithTheRightSign) {
  const DepthNoise noise;
  for (double z = 0.5; z < 6; z += 0.25)
    EXPECT_NEAR(noise.sigma_m(z), 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4), 1e-6) << z;
}

TEST(DepthImage, UnitsAreMetres) {
  DepthImage depth{Image<std::uint16_t>(2, 1), 1.0 / 5000};
  depth.units(1, 0) = 10000;
  EXPECT_DOUBLE_EQ(depth.depth_m(1, 0), 2.0);
  EXPECT_EQ(depth.depth_m(0, 0), 0.0);
}

TEST(RoundUp, IsTheNextMultiple) {
  EXPECT_EQ(round_up(0, 32), 0);
  EXPECT_EQ(round_up(1, 32), 32);
  EXPECT_EQ(round_up(std::size_t{64}, std::size_t{32}), 64U);
}

}  // namespace
}  // namespace hm
