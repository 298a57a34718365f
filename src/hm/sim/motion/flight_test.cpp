#include "hm/sim/motion/flight.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "hm/sensors/imu.hpp"
#include "hm/sim/sensor/imu_sensor.hpp"
#include "hm/sim/sensor/renderer.hpp"

namespace hm {
namespace {

double tilt_rad(const Flight& flight, double t) {
  return std::acos(std::clamp(flight.T_world_base(t).rotation()(2, 2), -1.0, 1.0));
}

struct Case {
  std::string name;
  World world;
  Flight flight;
};

std::vector<Case> cases() {
  std::vector<Case> all;
  all.push_back({"house", make_house(1), house_flight({}, 1)});
  all.push_back({"room", make_room(), room_flight({}, 1)});
  all.push_back({"corridor", make_corridor(), corridor_flight({}, 1)});
  return all;
}

TEST(Flight, DerivativesAreThoseOfThePath) {
  const Flight flight = room_flight({}, 3);
  constexpr double kH = 1e-4;
  for (double t = 0.3; t < flight.duration_s(); t += 0.37) {
    const double knots = t / 0.5;  // where the fourth derivative has a kink
    if (std::abs(knots - std::round(knots)) < 1e-3) continue;
    const FlightState before = flight.state(t - kH), here = flight.state(t), after = flight.state(t + kH);
    const auto slope = [&](const Vec3& a, const Vec3& b) -> Vec3 { return (b - a) / (2 * kH); };
    EXPECT_LT(
        (slope(before.T_world_base.translation(), after.T_world_base.translation()) - here.velocity_world_m_s)
            .norm(),
        1e-6);
    EXPECT_LT(
        (slope(before.velocity_world_m_s, after.velocity_world_m_s) - here.acceleration_world_m_s2).norm(),
        1e-6);
    const Mat3 turn = before.T_world_base.rotation().transpose() * after.T_world_base.rotation();
    EXPECT_LT((so3_log(turn) / (2 * kH) - here.angular_velocity_base_rad_s).norm(), 1e-6);
    EXPECT_LT((slope(before.angular_velocity_base_rad_s, after.angular_velocity_base_rad_s) -
               here.angular_acceleration_base_rad_s2)
                  .norm(),
              1e-5);
    EXPECT_TRUE(is_rigid(here.T_world_base));
  }
}

TEST(Flight, ThrustAloneHoldsTheVehicle) {
  const Flight flight = house_flight({}, 1);
  for (double t = 0; t < flight.duration_s(); t += 0.21) {
    const ImuSample felt = exact_imu(flight.state(t), SE3());
    EXPECT_NEAR(felt.specific_force_m_s2.x(), 0, 1e-9);
    EXPECT_NEAR(felt.specific_force_m_s2.y(), 0, 1e-9);
    EXPECT_GT(felt.specific_force_m_s2.z(), 5);
  }
}

TEST(Flight, StartsAndEndsAtRestOnTheGround) {
  for (const Case& c : cases()) {
    for (const double t : {0.0, c.flight.duration_s()}) {
      const FlightState state = c.flight.state(t);
      EXPECT_NEAR(state.T_world_base.translation().z(), kBaseOverGround_m, 1e-12) << c.name;
      EXPECT_LT(state.velocity_world_m_s.norm(), 1e-12) << c.name;
      EXPECT_LT(state.angular_velocity_base_rad_s.norm(), 1e-12) << c.name;
      EXPECT_LT(tilt_rad(c.flight, t), 1e-9) << c.name;
    }
  }
}

TEST(Flight, FliesAsQuadrotorsDo) {
  for (const Case& c : cases()) {
    double speed = 0, tilt = 0, yaw_rate = 0;
    for (double t = 0; t < c.flight.duration_s(); t += 0.02) {
      const FlightState state = c.flight.state(t);
      speed = std::max(speed, state.velocity_world_m_s.norm());
      tilt = std::max(tilt, tilt_rad(c.flight, t));
      yaw_rate = std::max(yaw_rate, state.angular_velocity_base_rad_s.norm());
    }
    EXPECT_GT(speed, 0.9) << c.name;
    EXPECT_LT(speed, 1.3) << c.name;
    EXPECT_GT(tilt, 0.1) << c.name;
    EXPECT_LT(tilt, 0.35) << c.name;
    EXPECT_LT(yaw_rate, 2.0) << c.name;
  }
}

/// The vehicle is about 0.6 m wide.
TEST(Flight, TouchesNothing) {
  const World worlds[] = {make_house(1), make_room(), make_corridor()};
  for (const double speed_m_s : {0.5, 1.0, 2.0}) {
    FlightParams params;
    params.speed_m_s = speed_m_s;
    const Flight flights[] = {house_flight(params, 1), room_flight(params, 1), corridor_flight(params, 1)};
    for (std::size_t i = 0; i < 3; ++i) {
      const Renderer renderer(worlds[i]);
      double nearest = 1;
      for (double t = 0; t < flights[i].duration_s(); t += 0.1) {
        const Vec3 p = flights[i].T_world_base(t).translation();
        if (p.z() < 0.6) continue;  // takes off or lands
        nearest = std::min(nearest, renderer.clearance_m(p, 1));
        EXPECT_GT(nearest, 0.3) << worlds[i].name << " at " << p.transpose() << ", " << t << " s";
        if (nearest < 0.3) break;
      }
      EXPECT_LT(nearest, 1) << worlds[i].name;
    }
  }
}

TEST(Flight, PassesOverStepsOfTheFloorLevel) {
  const World world = make_house(1);
  const Renderer renderer(world);
  const Flight flight = house_flight({}, 1);
  std::vector<double> levels;
  for (double t = 0; t < flight.duration_s(); t += 0.05) {
    const Vec3 p = flight.T_world_base(t).translation();
    const Ray down{p, -Vec3::UnitZ(), 0};
    RayHit hit;
    renderer.cast({&down, 1}, {&hit, 1});
    levels.push_back(p.z() - hit.range_m);
  }
  std::size_t steps = 0;
  for (std::size_t i = 1; i < levels.size(); ++i) steps += std::abs(levels[i] - levels[i - 1]) > 0.15;
  EXPECT_GE(steps, 10u);
  EXPECT_NEAR(*std::max_element(levels.begin(), levels.end()), 1.13, 1e-3);  // the railing
  for (const double level_m :
       {0.42, 0.18, 0.75, 0.6, 0.56})  // coffee table, platform, dining table, guests', bed
    EXPECT_GE(std::ranges::count_if(levels, [&](double l) { return std::abs(l - level_m) < 1e-3; }), 5)
        << level_m;
}

TEST(Flight, HeadsWhereItGoes) {
  const Flight flight = corridor_flight({}, 1);
  for (const double t : {15.0, 25.0}) {
    const FlightState state = flight.state(t);
    const Vec3 ahead = state.T_world_base.rotation().col(0);
    EXPECT_GT(ahead.dot(state.velocity_world_m_s.normalized()), 0.9) << t;
  }
}

TEST(Flight, SwayIsSeededAndCanBeOff) {
  FlightParams still;
  still.sway_m = 0;
  const Flight a = room_flight({}, 1), b = room_flight({}, 1), c = room_flight({}, 2);
  const Flight d = room_flight(still, 1), e = room_flight(still, 2);
  bool differs = false;
  for (double t = 0; t < a.duration_s(); t += 0.5) {
    EXPECT_EQ(a.T_world_base(t).matrix(), b.T_world_base(t).matrix());
    EXPECT_EQ(d.T_world_base(t).matrix(), e.T_world_base(t).matrix());
    differs |= a.T_world_base(t).matrix() != c.T_world_base(t).matrix();
    EXPECT_LT((a.T_world_base(t).translation() - d.T_world_base(t).translation()).norm(), 0.1);
  }
  EXPECT_TRUE(differs);
}

/// Dead reckoning: second-order integration of an ideal IMU at a lever arm from the base.
double drift_m(const Flight& flight, const SE3& T_base_imu, double rate_hz) {
  const double step = 1 / rate_hz;
  const FlightState start = flight.state(0);
  Mat3 R = start.T_world_base.rotation() * T_base_imu.rotation();
  Vec3 p = start.T_world_base * T_base_imu.translation(), v = Vec3::Zero();
  ImuSample before = exact_imu(start, T_base_imu);
  const auto steps = static_cast<int>(flight.duration_s() * rate_hz);
  for (int i = 1; i <= steps; ++i) {
    const ImuSample now = exact_imu(flight.state(i * step), T_base_imu);
    const Mat3 R_before = R;
    R *= so3_exp(0.5 * step * (before.angular_velocity_rad_s + now.angular_velocity_rad_s));
    const Vec3 a = 0.5 * (R_before * before.specific_force_m_s2 + R * now.specific_force_m_s2) -
                   Vec3(0, 0, kGravity_m_s2);
    p += step * v + 0.5 * step * step * a;
    v += step * a;
    before = now;
  }
  return (p - flight.state(steps * step).T_world_base * T_base_imu.translation()).norm();
}

TEST(Flight, ExactImuIntegratesBackToTheTruth) {
  const Flight flight = room_flight({}, 1);
  const SE3 off_center(so3_exp({0.3, -0.2, 1.0}), {0.1, -0.05, 0.07});
  for (const SE3& mount : {SE3(), off_center}) {
    const double coarse = drift_m(flight, mount, 200), fine = drift_m(flight, mount, 1000);
    EXPECT_LT(fine, 0.01);
    EXPECT_LT(fine, 0.1 * coarse);  // second order: 25 times less
  }
}

TEST(ImuErrors, HaveTheStatedSizesAndSwitches) {
  ImuSensorParams params;
  ImuSample still;
  still.specific_force_m_s2 = {0, 0, kGravity_m_s2};
  still.R_world_imu = Mat3::Identity();
  ImuErrors none(params, {false, false, false}, 1);
  EXPECT_EQ(none.next(still).specific_force_m_s2, still.specific_force_m_s2);
  EXPECT_EQ(*none.next(still).R_world_imu, Mat3::Identity());

  ImuErrors noisy(params, {true, false, false}, 1);
  double squares = 0;
  constexpr int kCount = 20000;
  for (int i = 0; i < kCount; ++i) squares += noisy.next(still).angular_velocity_rad_s.squaredNorm() / 3;
  EXPECT_NEAR(std::sqrt(squares / kCount) / (params.kGyroDensity_rad_s_sqrt_hz * std::sqrt(200)), 1, 0.02);

  double bias = 0, tilt = 0;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    ImuErrors biased(params, {false, true, true}, seed);
    const ImuSample sample = biased.next(still);
    bias += (sample.specific_force_m_s2 - still.specific_force_m_s2).squaredNorm() / 3;
    tilt += so3_log(*sample.R_world_imu).head<2>().squaredNorm() / 2;
  }
  EXPECT_NEAR(std::sqrt(bias / 300) / params.kAccelBias_m_s2, 1, 0.1);
  EXPECT_NEAR(std::sqrt(tilt / 300) / params.kTiltSigma_rad, 1, 0.1);
  params.imu_orientation = false;
  EXPECT_FALSE(ImuErrors(params, {}, 1).next(still).R_world_imu);
}

/// The bias after a time has the variance that its walk adds.
TEST(ImuErrors, BiasWanders) {
  ImuSensorParams params;
  params.gyro_bias_rad_s = 0;
  double squares = 0;
  constexpr int kRuns = 200, kSteps = 400;  // 2 s
  for (std::uint64_t seed = 0; seed < kRuns; ++seed) {
    ImuErrors errors(params, {false, true, false}, seed);
    ImuSample last;
    for (int i = 0; i <= kSteps; ++i) last = errors.next({});
    squares += last.angular_velocity_rad_s.squaredNorm() / 3;
  }
  EXPECT_NEAR(std::sqrt(squares / kRuns) / (params.kGyroBiasWalk_rad_s2_sqrt_hz * std::sqrt(2)), 1, 0.12);
}

}  // namespace
}  // namespace hm
