#include <gtest/gtest.h>

#include <cmath>

#include "hm/sim/vehicle/stream_link.hpp"
#include "hm/sim/vehicle/vehicle.hpp"
#include "hm/sim/vehicle/vehicle_test_support.hpp"

namespace hm {
namespace {

using namespace test;

/// Samples of a second and a half of hovering with vibration, noise and a fault from 0.5 s to 1 s; entry i
/// is that of the step that ends at i + 1 ms.
struct FaultedFlight {
  explicit FaultedFlight(std::string_view fault) : vehicle(setup(fault), cast_into_nothing()) {
    for (int i = 0; i < 1500; ++i) {
      samples.push_back(vehicle.step(rotors_at(583.5)));
      speeds.push_back(vehicle.rotor_speed_rad_s());
      voltages.push_back(vehicle.battery().voltage_v());
      winds.push_back(vehicle.wind_world_m_s().norm());
    }
  }
  static VehicleSetup setup(std::string_view fault) {
    VehicleSetup setup = calm_vehicle();
    setup.imu_effects = {};
    if (!fault.empty()) setup.faults = faults_of(fmt::format("fault {} at 0.5 for 0.5", fault));
    return setup;
  }
  Vehicle vehicle;
  std::vector<std::optional<ImuSample>> samples;
  std::vector<RotorValues> speeds;
  std::vector<double> voltages, winds;
};

TEST(VehicleFaults, WithoutFaultNothingIsMissing) {
  const FaultedFlight flown("");
  for (std::size_t i = 0; i < flown.samples.size(); ++i) {
    ASSERT_TRUE(flown.samples[i]);
    EXPECT_EQ(flown.samples[i]->stamp.ns, static_cast<std::int64_t>(i + 1) * 1'000'000);
    if (i == 0) continue;
    EXPECT_NE(flown.samples[i]->specific_force_m_s2, flown.samples[i - 1]->specific_force_m_s2);
  }
  EXPECT_EQ(flown.winds[700], 0);
}

TEST(VehicleFaults, ImuGapLosesSamples) {
  const FaultedFlight flown("imu_gap"), sound("");
  for (std::size_t i = 0; i < flown.samples.size(); ++i) {
    EXPECT_EQ(flown.samples[i].has_value(), i + 1 < 500 || i + 1 >= 1000) << i;
    if (!flown.samples[i]) continue;
    EXPECT_EQ(flown.samples[i]->specific_force_m_s2, sound.samples[i]->specific_force_m_s2);
  }
}

TEST(VehicleFaults, StuckImuRepeatsValuesWithNewStamps) {
  const FaultedFlight flown("imu_stuck");
  for (std::size_t i = 499; i < 999; ++i) {
    EXPECT_EQ(flown.samples[i]->specific_force_m_s2, flown.samples[498]->specific_force_m_s2);
    EXPECT_EQ(flown.samples[i]->angular_velocity_rad_s, flown.samples[498]->angular_velocity_rad_s);
    EXPECT_EQ(flown.samples[i]->stamp.ns, static_cast<std::int64_t>(i + 1) * 1'000'000);
  }
  EXPECT_NE(flown.samples[999]->specific_force_m_s2, flown.samples[498]->specific_force_m_s2);
}

TEST(VehicleFaults, ClockStepsAheadAndBack) {
  const FaultedFlight flown("clock_step");
  const auto stamp = [&](std::size_t i) { return flown.samples[i]->stamp.ns; };
  EXPECT_EQ(stamp(499) - stamp(498), 501'000'000);
  EXPECT_EQ(stamp(700) - stamp(699), 1'000'000);
  EXPECT_EQ(stamp(999) - stamp(998), -499'000'000);
}

TEST(VehicleFaults, LostMotorStopsAndTurnsTheVehicleOver) {
  const FaultedFlight flown("motor_lost");
  EXPECT_NEAR(flown.speeds[450][0], 583.5, 0.1);
  EXPECT_LT(flown.speeds[700][0], 1);
  EXPECT_NEAR(flown.speeds[700][1], 583.5, 0.1);
  EXPECT_NEAR(flown.speeds[1200][0], 583.5, 0.1);
  const FaultedFlight sound("");
  EXPECT_LT(sound.vehicle.state().T_world_base.angle(), 0.1);
  EXPECT_GT(flown.vehicle.state().angular_velocity_base_rad_s.norm(), 3);
}

TEST(VehicleFaults, LostCellLowersTheVoltage) {
  const FaultedFlight flown("cell_lost");
  const VehicleParams params;
  const double rotors_w = params.airframe.mass_kg * kGravity_m_s2 * params.rotor.torque_ratio_m * 583.5;
  const double power_w = rotors_w / BatteryParams::kMotorEfficiency + params.battery.kAvionicsPower_w;
  const auto loaded_v = [&](double open_v) {
    return (open_v + std::sqrt(open_v * open_v - 4 * params.battery.internal_resistance_ohm * power_w)) / 2;
  };
  EXPECT_NEAR(flown.voltages[450], loaded_v(12.6), 0.01);
  EXPECT_NEAR(flown.voltages[700], loaded_v(8.4), 0.01);
  EXPECT_NEAR(flown.voltages[1200], loaded_v(12.6), 0.01);
}

TEST(VehicleFaults, GustBlows) {
  const FaultedFlight flown("gust");
  EXPECT_EQ(flown.winds[450], 0);
  EXPECT_NEAR(flown.winds[749], WindParams::kFaultGust_m_s, 1e-2);
  EXPECT_EQ(flown.winds[1010], 0);
  EXPECT_GT(flown.vehicle.state().velocity_world_m_s.head<2>().norm(), 0.1);
}

TEST(VehicleFaults, LinksAreCutAndNoisy) {
  VehicleSetup setup = calm_vehicle();
  setup.faults = faults_of("fault link_cut at 0.2 for 0.1\nfault link_noise at 0.5 for 0.2");
  Vehicle vehicle(setup, cast_into_nothing());
  StreamLink<std::vector<std::uint8_t>> link(kSerialLink, 3);
  std::vector<int> arrived(10, 0), damaged(10, 0);
  for (int i = 0; i < 1000; ++i) {
    link.set_faults(vehicle.has_fault(FaultKind::kLinkCut), vehicle.has_fault(FaultKind::kLinkNoise));
    link.send(vehicle.now(), std::vector<std::uint8_t>(20, static_cast<std::uint8_t>(i / 100)));
    (void)vehicle.step({});
    while (const auto arrival = link.receive(Time::from_seconds(2))) {
      const auto tenth = static_cast<std::uint8_t>(i / 100);
      ++arrived[tenth];
      damaged[tenth] += arrival->message == std::vector<std::uint8_t>(20, tenth) ? 0 : 1;
    }
  }
  EXPECT_EQ(arrived, (std::vector<int>{100, 100, 0, 100, 100, 100, 100, 100, 100, 100}));
  for (std::size_t i = 0; i < damaged.size(); ++i) EXPECT_EQ(damaged[i] > 0, i == 5 || i == 6) << i;
}

TEST(VehicleFaults, BlackCameraIsReportedToItsSensor) {
  const FaultedFlight flown("camera_black");
  EXPECT_FALSE(flown.vehicle.has_fault(FaultKind::kCameraBlack));  // over
  EXPECT_TRUE(flown.vehicle.faults().is_active(FaultKind::kCameraBlack, Duration::from_seconds(0.6)));
}

TEST(VehicleFaults, WithABuiltInAttitudeLoopALostMotorIsFatalToo) {
  for (const InnerLoopKind kind : {InnerLoopKind::kSecondOrder, InnerLoopKind::kFirstOrder}) {
    VehicleSetup setup = calm_vehicle();
    setup.params.inner_loop.inner_loop = kind;
    setup.faults = faults_of("fault motor_lost at 0.5 for 10");
    Vehicle vehicle(setup, cast_into_nothing());
    VehicleCommand command;
    command.attitude.thrust_ratio = 0.485;
    for (int i = 0; i < 500; ++i) (void)vehicle.step(command);
    EXPECT_LT(vehicle.state().T_world_base.angle(), 1e-6);
    for (int i = 0; i < 700; ++i) (void)vehicle.step(command);
    EXPECT_GT(vehicle.state().angular_velocity_base_rad_s.norm(), 3);
  }
}

}  // namespace
}  // namespace hm
