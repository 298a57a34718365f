#include "hm/control/mixer.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace hm {
namespace {

constexpr float kTolerance_n = 3e-6F;

/// Slow reference: the largest share of the tilt torques (by bisection over whether any thrust lets all
/// rotors stay in their limits), then the thrust nearest to the wanted one by fine search, then the largest
/// yaw share likewise.
struct SlowMix {
  double tilt_share, mean_n, yaw_share;
};

SlowMix slow_mix(const Mixer& mixer, const QuadrotorModel& model, const MixerDemand& demand) {
  const double least = mixer.min_rotor_thrust_n(), most = mixer.max_rotor_thrust_n();
  const double ceiling = std::max(least, std::min(most, static_cast<double>(demand.max_thrust_n) / 4));
  const double arm = model.arm_m;
  const double roll = demand.torque_n_m.x() / (2 * arm), pitch = demand.torque_n_m.y() / (2 * arm);
  const double tilt[4] = {-pitch, roll, pitch, -roll};
  const double yaw = demand.torque_n_m.z() / (4 * model.torque_ratio_m);
  const double turn[4] = {yaw, -yaw, yaw, -yaw};
  const auto fits = [&](double mean, double tilt_share, double yaw_share) {
    for (int i = 0; i < 4; ++i) {
      const double thrust = mean + tilt_share * tilt[i] + yaw_share * turn[i];
      if (thrust < least - 1e-6 || thrust > most + 1e-6) return false;
    }
    return mean <= ceiling + 1e-6;
  };
  const auto nearest_mean = [&](double share) {
    double low = least, high = ceiling;
    for (const double t : tilt) {
      low = std::max(low, least - share * t);
      high = std::min(high, most - share * t);
    }
    return std::min(std::max(static_cast<double>(demand.thrust_n) / 4, low), std::max(low, high));
  };
  const auto largest = [](const auto& allowed) {
    if (allowed(1.0)) return 1.0;
    double low = 0, high = 1;
    for (int i = 0; i < 40; ++i) (allowed(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
    return low;
  };
  const double share = largest([&](double s) { return fits(nearest_mean(s), s, 0); });
  const double mean = nearest_mean(share);
  return {share, mean, largest([&](double s) { return fits(mean, share, s); })};
}

TEST(Mixer, PrioritiesHoldOverTheWholeRangeOfDemands) {
  const QuadrotorModel model;
  const Mixer mixer(model);
  int tilt_limited = 0, thrust_limited = 0, yaw_limited = 0, none = 0;
  for (const float ceiling : {1e3F, 20.0F, 5.0F, 0.0F})
    for (float thrust = -2; thrust < 32; thrust += 2.1F)
      for (float roll = -4; roll <= 4; roll += 0.57F)
        for (float pitch = -4; pitch <= 4; pitch += 0.83F)
          for (float yaw = -0.6F; yaw <= 0.6F; yaw += 0.15F) {
            const MixerDemand demand{thrust, Vec3f(roll, pitch, yaw), ceiling};
            const MixerResult result = mixer.mix(demand);
            const SlowMix slow = slow_mix(mixer, model, demand);
            for (const float rotor : result.rotor_thrust_n) {
              ASSERT_GE(rotor, mixer.min_rotor_thrust_n());
              ASSERT_LE(rotor, mixer.max_rotor_thrust_n());
            }
            ASSERT_NEAR(result.torque_n_m.x(), slow.tilt_share * roll, 2e-5);
            ASSERT_NEAR(result.torque_n_m.y(), slow.tilt_share * pitch, 2e-5);
            ASSERT_NEAR(result.thrust_n, 4 * slow.mean_n, 1e-4) << thrust << " " << roll << " " << pitch;
            ASSERT_NEAR(result.torque_n_m.z(), slow.yaw_share * yaw, 2e-5);
            tilt_limited += result.tilt_limited;
            thrust_limited += result.thrust_limited;
            yaw_limited += result.yaw_limited;
            none += !result.tilt_limited && !result.thrust_limited && !result.yaw_limited;
          }
  EXPECT_GT(tilt_limited, 1000);
  EXPECT_GT(thrust_limited, 1000);
  EXPECT_GT(yaw_limited, 1000);
  EXPECT_GT(none, 100);
}

TEST(Mixer, WhatFitsIsGivenExactlyInBothLayouts) {
  for (const RotorLayout layout : {RotorLayout::kPlus, RotorLayout::kCross}) {
    QuadrotorModel model;
    model.layout = layout;
    const MixerResult result = Mixer(model).mix({13.6F, Vec3f(0.2F, -0.3F, 0.05F)});
    EXPECT_NEAR(result.thrust_n, 13.6F, 1e-5F);
    EXPECT_LT((result.torque_n_m - Vec3f(0.2F, -0.3F, 0.05F)).norm(), 1e-6F);
    EXPECT_FALSE(result.tilt_limited || result.thrust_limited || result.yaw_limited);
  }
}

TEST(Mixer, SignsAreThoseOfTheVehicle) {
  const Mixer mixer{QuadrotorModel{}};  // front, left, back, right
  const auto rotors = [&](float x, float y, float z) {
    return mixer.mix({13.6F, Vec3f(x, y, z)}).rotor_thrust_n;
  };
  EXPECT_GT(rotors(0.1F, 0, 0)[1], rotors(0.1F, 0, 0)[3]) << "roll to the right: the left rotor lifts";
  EXPECT_GT(rotors(0, 0.1F, 0)[2], rotors(0, 0.1F, 0)[0]) << "nose down: the back rotor lifts";
  EXPECT_GT(rotors(0, 0, 0.1F)[0], rotors(0, 0, 0.1F)[1]) << "counter-clockwise: the clockwise rotors push";
}

TEST(Mixer, NothingRaisesTheThrustAboveItsCeiling) {
  const Mixer mixer{QuadrotorModel{}};
  const MixerResult result = mixer.mix({0, Vec3f(1, 1, 0.1F), 0});
  EXPECT_NEAR(result.thrust_n, 4 * mixer.min_rotor_thrust_n(), kTolerance_n);
  EXPECT_NEAR(result.torque_n_m.norm(), 0, 1e-6F);
  EXPECT_GT(mixer.mix({0, Vec3f(1, 1, 0.1F)}).thrust_n, 1) << "without one, tilt raises it";
}

TEST(Mixer, SpeedsGiveTheThrust) {
  const QuadrotorModel model;
  const Mixer mixer(model);
  EXPECT_NEAR(mixer.rotor_speed_rad_s(model.rotor_thrust_n(583.5F)), 583.5F, 1e-3F);
  EXPECT_EQ(mixer.rotor_speed_rad_s(-1), 0);
  // The author's vehicle hovers at 48.5 % (CityFlyer launch file), with 583.5 rad/s
  EXPECT_NEAR(model.mass_kg * kGravityF_m_s2 / model.full_thrust_n(), 0.485F, 5e-4F);
  EXPECT_NEAR(mixer.rotor_speed_rad_s(0.25F * model.mass_kg * kGravityF_m_s2), 583.5F, 0.1F);
}

}  // namespace
}  // namespace hm
