#include "hm/control/hover_thrust.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "hm/core/rng.hpp"
#include "hm/geometry/float/float_math.hpp"

namespace hm {
namespace {

constexpr float kThrustStep_s = 0.001F;

TEST(HoverThrust, AgreesWithTheClosedFormOfAConstant) {
  // Constant thrust T, no walk: 1/P = 1/P0 + n T^2 / R, and the estimate is the weighted mean.
  const QuadrotorModel model;
  HoverThrustParams params;
  params.walk_ratio_sqrt_s = 0;
  HoverThrust hover(params, model, kThrustStep_s);
  const float thrust = 13.6F;
  hover.follow(thrust);
  const double prior = 1 / 1.387, p0 = std::pow(0.15 * prior, 2), r = 4, t2 = 13.6 * 13.6;
  const double truth = 1 / (1.2 * 1.387);
  for (int n = 1; n <= 3000; ++n) {
    hover.step(thrust, static_cast<float>(truth * 13.6));
    if (n % 500) continue;
    const double p = 1 / (1 / p0 + n * t2 / r);
    EXPECT_NEAR(static_cast<double>(hover.variance()) / p, 1, 1e-3) << n;
    const double estimate = p * (prior / p0 + n * t2 / r * truth);
    EXPECT_NEAR(9.80665 / static_cast<double>(hover.hover_thrust_n()), estimate, 2e-4 * estimate) << n;
  }
}

TEST(HoverThrust, FollowsAFallingBatteryThroughVibration) {
  const QuadrotorModel model;
  HoverThrust hover({}, model, kThrustStep_s);
  hover.follow(13.6F);
  Rng rng(1);
  double worst = 0;
  for (int i = 0; i < 60000; ++i) {
    const double factor = 1 - 0.15 * i / 60000;  // 15 % of the thrust in a minute
    const double thrust = 13.6 / factor;
    hover.step(static_cast<float>(thrust), static_cast<float>(thrust * factor / 1.387 + rng.normal(0, 1.5)));
    if (i > 5000)
      worst = std::max(worst, std::abs(static_cast<double>(hover.hover_thrust_n()) * factor / 13.602 - 1));
  }
  EXPECT_LT(worst, 0.02);
}

TEST(HoverThrust, LearnsNothingFromTheGroundFromNoNumbersOrFromBumps) {
  const QuadrotorModel model;
  HoverThrust hover({}, model, kThrustStep_s);
  const float before = hover.hover_thrust_n();
  EXPECT_NEAR(before, 1.387F * kGravityF_m_s2, 1e-4F);
  for (int i = 0; i < 1000; ++i) hover.step(2, kGravityF_m_s2);  // stands with its rotors idling
  EXPECT_EQ(hover.hover_thrust_n(), before);
  hover.follow(13.6F);
  for (int i = 0; i < 100; ++i) hover.step(13.6F, std::numeric_limits<float>::quiet_NaN());
  for (int i = 0; i < 100; ++i) hover.step(13.6F, 200);
  EXPECT_EQ(hover.hover_thrust_n(), before);
  for (int i = 0; i < 60000; ++i) hover.step(13.6F, 0);
  EXPECT_LE(hover.hover_thrust_n(), 2.0001F * before) << "bounded whatever it sees";
}

TEST(HoverThrust, ThrustReachesTheMeasurementWithTheRotorsLag) {
  // A step of the command whose force follows with the rotors' time constant is no change of the hover
  // thrust.
  const QuadrotorModel model;
  HoverThrust hover({}, model, kThrustStep_s);
  hover.follow(13.6F);
  double lagged = 13.6;
  for (int i = 0; i < 200; ++i) {
    lagged += (18 - lagged) * 0.001 / static_cast<double>(model.motor_s + kThrustStep_s);
    hover.step(18, static_cast<float>(lagged / 1.387));
  }
  EXPECT_NEAR(hover.hover_thrust_n(), 13.602F, 0.02F);
}

}  // namespace
}  // namespace hm
