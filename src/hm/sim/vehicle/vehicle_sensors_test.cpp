#include "hm/sim/vehicle/vehicle_sensors.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/sim/sensor/laser_test_support.hpp"
#include "hm/sim/vehicle/vehicle_test_support.hpp"

namespace hm {
namespace {

using namespace test;

/// A vehicle without disturbances that drifts and turns in the room, and the perfect scans it takes.
struct SensedFlight {
  explicit SensedFlight(std::string_view script, VehicleSensorsSetup sensing = perfect_laser(),
                        int steps = 1000)
      : world(make_room()),
        renderer(world),
        vehicle(setup(script), cast_into(renderer)),
        sensors(world, renderer, sensing) {
    sensors.update(vehicle);
    truth.push_back({vehicle.now(), vehicle.state().T_world_base});
    for (int i = 0; i < steps; ++i) {
      VehicleCommand command;
      command.attitude = {0.05, 0.08, 0.6, 0.49};
      const auto sample = vehicle.step(command);
      sensors.update(vehicle, sample);
      truth.push_back({vehicle.now(), vehicle.state().T_world_base});
      while (auto scan = sensors.next_scan(vehicle.now())) scans.push_back(*scan);
      while (auto imu = sensors.next_imu(vehicle.now())) samples.push_back(*imu);
    }
  }
  static VehicleSensorsSetup perfect_laser() {
    VehicleSensorsSetup setup;
    setup.laser_effects = {false, false, false, false, true};
    return setup;
  }
  static VehicleSetup setup(std::string_view script) {
    VehicleSetup setup = calm_vehicle(Vec3(-0.5, -0.5, 1.2));
    setup.start = Time::from_seconds(5);
    setup.params.inner_loop.inner_loop = InnerLoopKind::kSecondOrder;
    setup.faults = faults_of(script);
    return setup;
  }
  World world;
  Renderer renderer;
  Vehicle vehicle;
  VehicleSensors sensors;
  Trajectory truth;
  std::vector<Received<LaserScan>> scans;
  std::vector<Received<ImuSample>> samples;
};

/// Greatest difference between ranges and those from the true poses turned by an angle, in the analytic room.
double greatest_error_m(const SensedFlight& flown, const LaserScan& scan, double turn_rad) {
  double greatest = 0;
  int beams = 0;
  for (std::size_t i = 0; i < scan.size(); i += 7) {
    if (!scan.is_return(i)) continue;
    const LaserRig& rig = flown.sensors.rig();
    const SE3* mount = &rig.T_base_laser;
    if (i < rig.down->beams.end) mount = &rig.down->T_base_virtual_laser;
    if (i >= rig.up->beams.begin) mount = &rig.up->T_base_virtual_laser;
    const auto base = pose_at(flown.truth, scan.stamp_of(i), Duration{2'000'000});
    const SE3 pose = *base * SE3(so3_exp({0, 0, turn_rad}), Vec3::Zero()) * *mount;
    const double angle = scan.angle_rad(i);
    const Ray ray{pose.translation(), pose.rotation() * Vec3(std::cos(angle), std::sin(angle), 0)};
    const auto range = traced_range(ray);
    if (!range || is_on_sphere(ray.origin_world + *range * ray.direction_world)) continue;
    greatest = std::max(greatest, std::abs(*range - static_cast<double>(scan.ranges_m[i])));
    ++beams;
  }
  return beams > 50 ? greatest : 1e9;
}

TEST(VehicleSensors, ScansAreThoseOfTheTruePoses) {
  const SensedFlight flown("");
  EXPECT_GT(flown.truth.back().T_world_base.angle(), 0.3);
  EXPECT_TRUE(flown.vehicle.collisions().empty());
  ASSERT_EQ(flown.scans.size(), 39U);  // of 40 a second; the last is under way
  for (std::size_t k = 0; k < flown.scans.size(); k += 6) {
    const LaserScan& scan = flown.scans[k].measured;
    EXPECT_EQ(scan.stamp.ns, 5'000'000'000 + static_cast<std::int64_t>(k) * 25'000'000);
    EXPECT_LT(greatest_error_m(flown, scan, 0), 1e-4) << k;
    EXPECT_GT(greatest_error_m(flown, scan, 0.05), 0.01) << k;  // the comparison sees a wrong pose
  }
}

TEST(VehicleSensors, ScansArriveTwentyMillisecondsAfterTheirSweep) {
  const SensedFlight flown("");
  for (const auto& scan : flown.scans) {
    const double delay_s = (scan.at - scan.measured.stamp_of(scan.measured.size() - 1)).seconds();
    EXPECT_GE(delay_s, 0.020 - 1e-6);
    EXPECT_LE(delay_s, 0.024 + 1e-6);
  }
  ASSERT_GT(flown.samples.size(), 990U);
  for (const auto& sample : flown.samples) {
    const double delay_s = (sample.at - sample.measured.stamp).seconds();
    EXPECT_GE(delay_s, 0.003 - 1e-9);
    EXPECT_LE(delay_s, 0.007 + 1e-9);
  }
}

TEST(VehicleSensors, LaserOffGivesNoScans) {
  const SensedFlight flown("fault laser_off at 0.3 for 0.3");
  ASSERT_EQ(flown.scans.size(), 27U);
  for (const auto& scan : flown.scans) {
    const double done_s = scan.measured.stamp_of(scan.measured.size() - 1).seconds() - 5;
    EXPECT_TRUE(done_s < 0.3 || done_s >= 0.6 - 1e-3) << done_s;
  }
}

TEST(VehicleSensors, TurnedSensorSeesTheRoomTurned) {
  const SensedFlight flown("fault sensor_turned at 0.3 for 0.3");
  EXPECT_LT(greatest_error_m(flown, flown.scans[18].measured, std::numbers::pi / 2), 1e-4);
  EXPECT_GT(greatest_error_m(flown, flown.scans[18].measured, 0), 0.1);
  EXPECT_LT(greatest_error_m(flown, flown.scans[30].measured, 0), 1e-4);
}

TEST(VehicleSensors, SameSeedSameBits) {
  VehicleSensorsSetup noisy;
  const SensedFlight a("", noisy, 200), b("", noisy, 200);
  noisy.seed = 2;
  const SensedFlight c("", noisy, 200);
  ASSERT_EQ(a.scans.size(), b.scans.size());
  ASSERT_GT(a.scans.size(), 4U);
  for (std::size_t i = 0; i < a.scans.size(); ++i) {
    EXPECT_TRUE(same(a.scans[i].measured, b.scans[i].measured));
    EXPECT_EQ(a.scans[i].at, b.scans[i].at);
    EXPECT_FALSE(same(a.scans[i].measured, c.scans[i].measured));
  }
}

TEST(VehicleSensors, HeightsAreThoseOfTheSurfaces) {
  const SensedFlight flown("", SensedFlight::perfect_laser(), 1);
  const Vec3 over_chest(1.9, 1.15, 1.5);
  const HeightTruth heights = true_heights(flown.renderer, Time{3}, over_chest);
  EXPECT_EQ(heights.stamp, Time{3});
  EXPECT_NEAR(heights.floor_m, 0.6, 1e-6);
  EXPECT_NEAR(heights.ceiling_m, 2.8, 1e-6);
}

}  // namespace
}  // namespace hm
