#include "hm/sim/vehicle/vehicle.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <thread>

#include "hm/sim/vehicle/vehicle_test_support.hpp"

namespace hm {
namespace {

using namespace test;

constexpr double kHover_rad_s = 583.5;

void append(std::vector<std::uint64_t>& bits, const Vec3& v) {
  for (const double x : v) bits.push_back(std::bit_cast<std::uint64_t>(x));
}

/// Bits of everything that a disturbed vehicle gives over a second and a half, with faults.
std::vector<std::uint64_t> flown_bits(std::uint64_t seed) {
  VehicleSetup setup;
  setup.seed = seed;
  setup.T_world_base = SE3(Mat3::Identity(), Vec3(0, 0, 1));
  setup.faults = faults_of("fault gust at 0.2 for 1\nfault cell_lost at 0.4 for 0.2");
  Vehicle vehicle(setup, cast_into_floor());
  std::vector<std::uint64_t> bits;
  for (int i = 0; i < 1500; ++i) {
    const auto sample = vehicle.step(rotors_at(kHover_rad_s + 20 * std::sin(0.01 * i)));
    append(bits, vehicle.state().T_world_base.translation());
    append(bits, vehicle.state().angular_velocity_base_rad_s);
    append(bits, sample->specific_force_m_s2);
    append(bits, sample->angular_velocity_rad_s);
    bits.push_back(std::bit_cast<std::uint64_t>(vehicle.battery().voltage_v()));
  }
  return bits;
}

TEST(Vehicle, SameSeedSameBitsInAnyNumberOfThreads) {
  const auto alone = flown_bits(3);
  std::vector<std::vector<std::uint64_t>> together(2);
  {
    std::vector<std::jthread> threads;
    for (auto& bits : together) threads.emplace_back([&bits] { bits = flown_bits(3); });
  }
  EXPECT_EQ(together[0], alone);
  EXPECT_EQ(together[1], alone);
  EXPECT_NE(flown_bits(4), alone);
}

TEST(Vehicle, HoversOnItsRotorsInStillAir) {
  VehicleSetup setup = calm_vehicle();
  Vehicle vehicle(setup, cast_into_nothing());
  const VehicleCommand hover = rotors_at(setup.params.hover_speed_rad_s());
  for (int i = 0; i < 500; ++i) (void)vehicle.step(hover);
  const double falling = vehicle.state().velocity_world_m_s.z();  // while the rotors started
  EXPECT_LT(falling, -0.05);
  std::optional<ImuSample> sample;
  for (int i = 0; i < 2000; ++i) sample = vehicle.step(hover);
  EXPECT_EQ(vehicle.now(), Time::from_seconds(2.5));
  EXPECT_NEAR(vehicle.state().velocity_world_m_s.z(), falling, 2e-3);  // slowed by the body's drag only
  EXPECT_LT(vehicle.state().T_world_base.angle(), 1e-9);
  EXPECT_NEAR(sample->specific_force_m_s2.z(), kGravity_m_s2, 1e-3);
  EXPECT_EQ(sample->stamp, vehicle.now());
}

TEST(Vehicle, SteadyFlightTiltsByTheRotorsDrag) {
  VehicleSetup setup = calm_vehicle();
  setup.params.airframe.body_drag_n_s2_m2 = 0;
  setup.params.inner_loop.inner_loop = InnerLoopKind::kSecondOrder;
  Vehicle vehicle(setup, cast_into_nothing());
  const RotorParams& rotor = setup.params.rotor;
  constexpr double kTilt_rad = 0.03;
  VehicleCommand command;
  command.attitude.pitch_rad = kTilt_rad;
  const double max_n = 4 * rotor.thrust_constant_n_s2 * rotor.max_speed_rad_s * rotor.max_speed_rad_s;
  const double weight_n = setup.params.airframe.mass_kg * kGravity_m_s2;
  for (int i = 0; i < 80'000; ++i) {
    const double sinking = -vehicle.state().velocity_world_m_s.z(),
                 below = 2 - vehicle.state().T_world_base.translation().z();
    command.attitude.thrust_ratio = (weight_n + 3 * below + 4 * sinking) / max_n;
    (void)vehicle.step(command);
  }
  const double speed = vehicle.state().velocity_world_m_s.x();
  const double drag = rotor.kDragConstant_n_s2_m * vehicle.rotor_speed_rad_s().sum();
  EXPECT_NEAR(vehicle.state().velocity_world_m_s.z(), 0, 1e-4);
  EXPECT_NEAR(std::tan(kTilt_rad), drag * speed / weight_n, 2e-4 * std::tan(kTilt_rad));
  EXPECT_GT(speed, 2);
}

TEST(Vehicle, RotorSpeedIsLimitedByTheVoltage) {
  VehicleSetup setup = calm_vehicle();
  setup.params.battery.initial_charge_ratio = 0.3;
  for (const bool governed : {true, false}) {
    setup.params.rotor.speed_governed = governed;
    Vehicle vehicle(setup, cast_into_nothing());
    for (int i = 0; i < 300; ++i) (void)vehicle.step(rotors_at(2000));
    const double limit = 838 * vehicle.battery().voltage_ratio();
    EXPECT_NEAR(vehicle.rotor_speed_rad_s()[0], limit, 1);
    EXPECT_LT(limit, 838);
    for (int i = 0; i < 300; ++i) (void)vehicle.step(rotors_at(500));
    EXPECT_NEAR(vehicle.rotor_speed_rad_s()[0], governed ? 500 : 500 * vehicle.battery().voltage_ratio(),
                0.5);
  }
}

TEST(Vehicle, RefusesCommandsThatAreNotFinite) {
  Vehicle vehicle(calm_vehicle(), cast_into_nothing());
  for (int i = 0; i < 200; ++i) (void)vehicle.step(rotors_at(400));
  VehicleCommand bad = rotors_at(500);
  bad.rotor_speed_rad_s[2] = std::nan("");
  VehicleCommand endless = rotors_at(500);
  endless.attitude.thrust_ratio = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 100; ++i) (void)vehicle.step(i % 2 == 0 ? bad : endless);
  EXPECT_EQ(vehicle.bad_commands(), 100U);
  EXPECT_NEAR(vehicle.rotor_speed_rad_s()[2], 400, 0.1);
  EXPECT_TRUE(vehicle.state().T_world_base.translation().allFinite());
}

TEST(Vehicle, ThrustErrorsAndTheCentreOfMassDisturbTheHover) {
  for (const bool is_thrust : {true, false}) {
    VehicleSetup setup = calm_vehicle();
    setup.params.rotor.thrust_mismatch_ratio = is_thrust ? 0.03 : 0;
    setup.params.airframe.com_offset_m = is_thrust ? 0 : 0.005;
    Vehicle vehicle(setup, cast_into_nothing());
    for (int i = 0; i < 400; ++i) (void)vehicle.step(rotors_at(kHover_rad_s));
    EXPECT_GT(vehicle.state().T_world_base.angle(), 0.02);
  }
}

TEST(Vehicle, FliesIntoAWallThatWasFarAway) {
  VehicleSetup setup = calm_vehicle();
  setup.params.inner_loop.inner_loop = InnerLoopKind::kSecondOrder;
  Vehicle vehicle(setup, cast_into_planes({{Vec3(1.5, 0, 0), -Vec3::UnitX()}}));
  VehicleCommand command;
  command.attitude = {0, 0.1, 0, 0.49};
  for (int i = 0; i < 2500; ++i) (void)vehicle.step(command);
  ASSERT_GE(vehicle.collisions().size(), 1U);
  EXPECT_NEAR(vehicle.collisions()[0].position_world.x(), 1.5, 0.03);
  EXPECT_LT(vehicle.state().T_world_base.translation().x(), 1.2);
}

TEST(Vehicle, IsPulledToACeilingAndCarriedByAFloor) {
  const VehicleSetup setup = calm_vehicle();
  const double rotor_z = 2 + setup.params.airframe.kRotorHeight_m, near = 0.16;
  Vehicle free(setup, cast_into_nothing());
  Vehicle below(setup, cast_into_planes({{Vec3(0, 0, rotor_z + near), -Vec3::UnitZ()}}));
  Vehicle above(setup, cast_into_planes({{Vec3(0, 0, rotor_z - 0.25), Vec3::UnitZ()}}));
  std::optional<ImuSample> in_air, at_ceiling, at_floor;
  for (int i = 0; i < 60; ++i) {
    in_air = free.step(rotors_at(kHover_rad_s));
    at_ceiling = below.step(rotors_at(kHover_rad_s));
    at_floor = above.step(rotors_at(kHover_rad_s));
  }
  const double radius = setup.params.rotor.kRadius_m, force = in_air->specific_force_m_s2.z();
  const double down = 2 - below.state().T_world_base.translation().z();
  EXPECT_NEAR(at_ceiling->specific_force_m_s2.z() / force, ground_effect_factor(near + down, radius), 2e-3);
  const double sunk = 2 - above.state().T_world_base.translation().z();
  EXPECT_NEAR(at_floor->specific_force_m_s2.z() / force, ground_effect_factor(0.25 - sunk, radius), 2e-3);
  EXPECT_GT(ground_effect_factor(near + down, radius), 1.01);
}

/// Rotor speeds of a simple cascade on the true state: position, attitude, mixer.
VehicleCommand hold(const VehicleParams& params, const FlightState& state, const Vec3& place) {
  const Mat3& R = state.T_world_base.rotation();
  const Vec3 acceleration = 3 * (place - state.T_world_base.translation()) - 3 * state.velocity_world_m_s +
                            Vec3(0, 0, kGravity_m_s2);
  Mat3 target;
  target.col(2) = acceleration.normalized();
  target.col(1) = target.col(2).cross(Vec3::UnitX()).normalized();
  target.col(0) = target.col(1).cross(target.col(2));
  const Vec3 turn = 120 * so3_log(R.transpose() * target) - 18 * state.angular_velocity_base_rad_s;
  const AirframeParams& a = params.airframe;
  const Eigen::Vector4d wrench(a.mass_kg * acceleration.dot(R.col(2)), a.inertia_xy_kg_m2 * turn.x(),
                               a.inertia_xy_kg_m2 * turn.y(), a.inertia_z_kg_m2 * 0.2 * turn.z());
  const RotorValues squared = rotor_mixing(a, params.rotor).inverse() * wrench;
  return {squared.cwiseMax(0).cwiseSqrt(), {}};
}

TEST(Vehicle, ASimpleControllerOnTheMotorsTakesOffAndHoldsItInWind) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    VehicleSetup setup;  // with all disturbances
    setup.seed = seed;
    Vehicle vehicle(setup, cast_into_floor());
    const Vec3 place(1, -0.5, 1.3);
    double furthest = 0;
    for (int i = 0; i < 30'000; ++i) {
      (void)vehicle.step(hold(setup.params, vehicle.state(), place));
      if (i > 6000)
        furthest = std::max(furthest, (vehicle.state().T_world_base.translation() - place).norm());
    }
    EXPECT_LT(furthest, 0.35) << seed;  // without an integrator; a lost sign throws it metres away
    EXPECT_GT(furthest, 0.01) << seed;  // the disturbances act
    EXPECT_EQ(vehicle.feet_down(), 0);
    EXPECT_TRUE(vehicle.collisions().empty());
    EXPECT_LT(vehicle.battery().charge_ratio(), 0.99);
  }
}

}  // namespace
}  // namespace hm
