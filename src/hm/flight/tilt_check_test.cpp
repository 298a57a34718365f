#include "hm/flight/tilt_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>

namespace hm {
namespace {

/// Flies a winding path; the poses are turned by an angle. The largest angle told from 4 s on.
std::optional<float> told_angle(float turned_rad, float amplitude_m) {
  TiltCheck check;
  std::optional<float> told;
  const float c = std::cos(turned_rad), s = std::sin(turned_rad);
  for (int i = 1; i < 12000; ++i) {
    const float t = 0.001F * static_cast<float>(i), w1 = 1.3F, w2 = 0.9F;
    const float x = amplitude_m * std::sin(w1 * t), y = amplitude_m * std::cos(w2 * t);
    check.step(-w1 * w1 * x, -w2 * w2 * y, 0.001F);
    if (i % 25 == 0) check.add_pose(Time{std::int64_t{1'000'000} * i}, c * x - s * y, s * x + c * y);
    if (i > 4000 && check.mismatch_rad()) {
      const float angle = *check.mismatch_rad();
      if (!told || std::abs(angle) > std::abs(*told)) told = angle;
    }
  }
  return told;
}

TEST(TiltCheck, TellsTheAngleByWhichASensorIsTurned) {
  const float quarter = std::numbers::pi_v<float> / 2;
  EXPECT_LT(std::abs(told_angle(0, 1.0F).value()), 0.3F);
  EXPECT_NEAR(told_angle(quarter, 1.0F).value(), quarter, 0.3F);
  EXPECT_NEAR(told_angle(-quarter, 1.0F).value(), -quarter, 0.3F);
  EXPECT_NEAR(std::abs(told_angle(2 * quarter, 1.0F).value()), 2 * quarter, 0.3F);
}

TEST(TiltCheck, TellsNothingWhileTheVehicleHovers) {
  EXPECT_EQ(told_angle(std::numbers::pi_v<float> / 2, 0.005F), std::nullopt);
}

}  // namespace
}  // namespace hm
