#include "hm/sim/sensor/carried_imu.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/sim/recording/simulation.hpp"

namespace hm {
namespace {

SE3 swung(double t) {
  return {so3_exp(Vec3(0.3 * std::sin(t), 0.8 * t, 0)), Vec3(0.2 * std::sin(2 * t), 0, 0.1 * t * t)};
}

std::vector<ImuSample> exact(double duration_s) {
  return carried_imu(swung, Time{}, duration_s, {}, {false, false, false}, 1);
}

/// Angular rates integrate to the rotation; specific forces equal gravity plus the exact acceleration.
TEST(CarriedImu, FeelsTheMotionOfItsPath) {
  const Mat3 R_camera_imu = R_camera_tablet_imu();
  const auto samples = exact(3);
  Mat3 R = swung(-0.0025).rotation();
  for (const ImuSample& sample : samples) {
    const double t = sample.stamp.seconds();
    const Vec3 a(-0.8 * std::sin(2 * t), 0, 0.2 + kGravity_m_s2);
    const Vec3 felt = swung(t).rotation() * (R_camera_imu * sample.specific_force_m_s2);
    EXPECT_LT((felt - a).norm(), 2e-3);
    R *= so3_exp(R_camera_imu * sample.angular_velocity_rad_s * 0.005);
  }
  EXPECT_LT(so3_log(R.transpose() * swung(3.0025).rotation()).norm(), 1e-3);
}

TEST(CarriedImu, ASimulationCarriesOneWithNoiseOfItsSeed) {
  SimulationParams params;
  params.world = WorldKind::kRoom;
  params.frame_limit = 11;
  const auto a = Simulation(params).imu(), b = Simulation(params).imu();
  ASSERT_EQ(a.size(), 401u);  // 2 s at 200 Hz
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].specific_force_m_s2, b[i].specific_force_m_s2);
  params.seed = 2;
  EXPECT_NE(Simulation(params).imu()[0].specific_force_m_s2, a[0].specific_force_m_s2);
  EXPECT_NEAR(a[0].specific_force_m_s2.norm(), kGravity_m_s2, 0.5);
  params.imu = false;
  EXPECT_TRUE(Simulation(params).imu().empty());
}

}  // namespace
}  // namespace hm
