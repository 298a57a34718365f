#include "hm/sim/vehicle/rotors.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace hm {
namespace {

constexpr double kRadius_m = 0.128;
const SurfacePlane kFloor{Vec3(5, -3, 0), Vec3::UnitZ()};

TEST(GroundEffect, HasTheFactorOfCheesemanAndBennett) {
  EXPECT_NEAR(ground_effect_factor(kRadius_m, kRadius_m), 1.0667, 5e-5);
  EXPECT_NEAR(ground_effect_factor(2 * kRadius_m, kRadius_m), 64.0 / 63, 1e-12);
  EXPECT_NEAR(ground_effect_factor(kRadius_m / 2, kRadius_m), 4.0 / 3, 1e-12);
  EXPECT_EQ(ground_effect_factor(0.01, kRadius_m), ground_effect_factor(kRadius_m / 2, kRadius_m));
  EXPECT_NEAR(ground_effect_factor(100, kRadius_m), 1, 1e-6);
}

TEST(GroundEffect, ActsAlongTheRotorsAxis) {
  RotorSurfaces surfaces{kFloor, std::nullopt};
  const Vec3 hub(0.3, 0.4, kRadius_m);
  EXPECT_NEAR(surface_effect_factor(surfaces, hub, Vec3::UnitZ(), kRadius_m), 16.0 / 15, 1e-12);
  const Vec3 tilted(std::sin(1), 0, std::cos(1));  // along the axis the floor is R / cos(1) away
  const double ratio = std::cos(1) / 4;
  EXPECT_NEAR(surface_effect_factor(surfaces, hub, tilted, kRadius_m), 1 / (1 - ratio * ratio), 1e-12);
  EXPECT_EQ(surface_effect_factor(surfaces, hub, -Vec3::UnitZ(), kRadius_m), 1);  // it blows away from it
}

TEST(GroundEffect, CeilingIsAMirroredFloor) {
  const SurfacePlane ceiling{Vec3(0, 0, 2), -Vec3::UnitZ()};
  const Vec3 hub(0, 0, 2 - kRadius_m);
  EXPECT_NEAR(surface_effect_factor({std::nullopt, ceiling}, hub, Vec3::UnitZ(), kRadius_m), 16.0 / 15,
              1e-12);
  const SurfacePlane shelf{Vec3(0, 0, 2 - 2 * kRadius_m), Vec3::UnitZ()};
  EXPECT_NEAR(surface_effect_factor({shelf, ceiling}, hub, Vec3::UnitZ(), kRadius_m), 256.0 / 225, 1e-12);
}

TEST(Rotors, MixingGivesThrustAndTorques) {
  const AirframeParams airframe;
  const RotorParams rotor;
  const Eigen::Matrix4d mixing = rotor_mixing(airframe, rotor);
  const auto wrench = [&](double front, double left, double back, double right) -> Eigen::Vector4d {
    return mixing * Eigen::Vector4d(front, left, back, right).cwiseAbs2();
  };
  const double thrust = rotor.thrust_constant_n_s2 * 600 * 600;
  EXPECT_TRUE(wrench(600, 600, 600, 600).isApprox(Eigen::Vector4d(4 * thrust, 0, 0, 0), 1e-12));
  // The left rotor rolls to the right (+x), the front one pitches up (-y), both seen along the axes.
  EXPECT_TRUE(wrench(0, 600, 0, 0).isApprox(Eigen::Vector4d(thrust, 0.21 * thrust, 0, -0.016 * thrust)));
  EXPECT_TRUE(wrench(600, 0, 0, 0).isApprox(Eigen::Vector4d(thrust, 0, -0.21 * thrust, 0.016 * thrust)));
}

TEST(ThrustErrors, HaveTheAskedDeviationsAndCorrelation) {
  const RotorParams params;
  double mismatch2 = 0;
  constexpr int kSeeds = 1000;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    RotorParams constant = params;
    constant.thrust_noise_ratio = 0;
    const RotorValues e = ThrustErrors(constant, static_cast<std::uint64_t>(seed)).factors().array() - 1;
    mismatch2 += e.squaredNorm() / 4;
  }
  EXPECT_NEAR(std::sqrt(mismatch2 / kSeeds), 0.03, 0.03 * 5 / std::sqrt(2.0 * 4 * kSeeds));

  RotorParams varying = params;
  varying.thrust_mismatch_ratio = 0;
  ThrustErrors errors(varying, 7);
  constexpr int kSteps = 400'000, kLag = 100;  // a lag of 0.1 s, the correlation time
  std::vector<double> e;
  for (int i = 0; i < kSteps; ++i, errors.step(1e-3)) e.push_back(errors.factors()[2] - 1);
  double power = 0, lagged = 0;
  for (std::size_t i = kLag; i < e.size(); ++i) power += e[i] * e[i], lagged += e[i] * e[i - kLag];
  EXPECT_NEAR(std::sqrt(power / kSteps), 0.01, 0.001);
  EXPECT_NEAR(lagged / power, std::exp(-1), 0.08);
}

}  // namespace
}  // namespace hm
