#include "hm/sim/sensor/laser_sensor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hm/sim/sensor/laser_test_support.hpp"

namespace hm {
namespace {

using namespace test;

TEST(LaserSensor, CorridorInClosedForm) {
  const LaserSimulation simulation(perfect(WorldKind::kCorridor));
  double tilt = 0;
  for (std::size_t i = 0; i < simulation.scan_count(); i += 61) {
    const LaserScan scan = simulation.scan(i).measured;
    tilt = std::max(tilt, std::acos(simulation.state_at(scan.stamp).T_world_base.rotation()(2, 2)));
    for (std::size_t beam = 0; beam < scan.size(); ++beam) {
      const bool hidden = (beam >= 20 && beam < 56) || (beam >= 1025 && beam < 1061);
      if (hidden) {
        ASSERT_TRUE(std::isnan(scan.ranges_m[beam])) << beam;
        continue;
      }
      const double expected = box_range(beam_ray(simulation, scan, beam), {0, -1, 0}, {30, 1, 2.5});
      if (expected > 30)
        ASSERT_EQ(scan.ranges_m[beam], LaserScan::kNoReturn);
      else
        ASSERT_NEAR(static_cast<double>(scan.ranges_m[beam]), expected, 2e-5) << i << " " << beam;
    }
  }
  EXPECT_GT(tilt, 0.02);
}

TEST(LaserSensor, RoomAsItsDistanceFunctionSays) {
  const LaserSimulation simulation(perfect(WorldKind::kRoom));
  std::size_t beams = 0, off = 0;
  for (std::size_t i = 0; i < simulation.scan_count(); i += 97) {
    const LaserScan scan = simulation.scan(i).measured;
    for (std::size_t beam = 0; beam < scan.size(); beam += 3) {
      if (std::isnan(scan.ranges_m[beam])) continue;
      const Ray ray = beam_ray(simulation, scan, beam);
      const auto expected = traced_range(ray);
      if (!expected || is_on_sphere(ray.origin_world + *expected * ray.direction_world)) continue;
      ++beams;
      off += std::abs(static_cast<double>(scan.ranges_m[beam]) - *expected) > 1e-5;
    }
  }
  EXPECT_GT(beams, 5000u);
  EXPECT_LE(off, beams / 500);  // those that pass a sphere closely
}

TEST(LaserSensor, MirrorsMeasureFloorAndCeiling) {
  const LaserSimulation simulation(perfect(WorldKind::kCorridor));
  const LaserRig& rig = simulation.rig();
  for (std::size_t i = 200; i < simulation.scan_count(); i += 151) {
    const LaserScan scan = simulation.scan(i).measured;
    const auto height_of = [&](std::size_t beam) {
      const Ray ray = beam_ray(simulation, scan, beam);
      return (ray.origin_world + static_cast<double>(scan.ranges_m[beam]) * ray.direction_world).z();
    };
    for (std::size_t beam = 0; beam < 20; ++beam) EXPECT_NEAR(height_of(beam), 0, 1e-5);
    for (std::size_t beam = rig.up->beams.begin; beam < rig.up->beams.end; ++beam)
      EXPECT_NEAR(height_of(beam), 2.5, 1e-5);
    // Straight below a level vehicle: the height of the virtual laser, but for the angle of the beam.
    const SE3 pose = simulation.state_at(scan.stamp).T_world_base;
    const double high_m = (pose * rig.down->T_base_virtual_laser).translation().z();
    EXPECT_NEAR(static_cast<double>(scan.ranges_m[10]), high_m, 0.05 * high_m);
  }
}

TEST(LaserSensor, MixedReadingsAreAtEdgesOnlyAndBetweenTheirSurfaces) {
  LaserSimulationParams params = perfect(WorldKind::kRoom);
  const LaserSimulation narrow(params);
  params.laser_effects.mixed_readings = true;
  const LaserSimulation wide(params);
  std::size_t mixed = 0;
  for (std::size_t i = 400; i < wide.scan_count(); i += 120) {
    const LaserScan a = narrow.scan(i).measured, b = wide.scan(i).measured;
    for (std::size_t beam = 0; beam < a.size(); ++beam) {
      if (std::isnan(a.ranges_m[beam])) continue;
      const auto reading = static_cast<double>(b.ranges_m[beam]);
      if (a.ranges_m[beam] == b.ranges_m[beam]) continue;
      // All around the cone: where the beam reads something else its surfaces are apart.
      const Ray axis = beam_ray(wide, b, beam);
      const Vec3 side = axis.direction_world.unitOrthogonal(), up = axis.direction_world.cross(side);
      double least = 1e9, most = 0;
      for (int k = 0; k < 360; ++k) {
        const double radius = params.laser.kBeamWidth_rad / 2 * std::sqrt(0.5),
                     turn = k * std::numbers::pi / 180;
        const Vec3 off = radius * (std::cos(turn) * side + std::sin(turn) * up);
        const auto range = traced_range({axis.origin_world, (axis.direction_world + off).normalized(), 0});
        if (range) least = std::min(least, *range), most = std::max(most, *range);
      }
      EXPECT_GT(most - least, 0.8 * params.laser.kEdgeStep_m) << beam;
      EXPECT_GT(reading, least - 0.02) << beam;
      EXPECT_LT(reading, most + 0.02) << beam;
      mixed += reading > least + 0.03 && reading < most - 0.03;
    }
  }
  EXPECT_GT(mixed, 20u);
}

TEST(LaserSensor, RangeNoiseAndRounding) {
  LaserSimulationParams params = perfect(WorldKind::kCorridor);
  params.scan_limit = 60;  // on the ground
  const LaserSimulation exact(params);
  params.laser_effects.range_noise = true;
  const LaserSimulation noisy(params);
  params.laser_effects.range_noise = false, params.laser_effects.range_rounding = true;
  const LaserSimulation rounded(params);
  double near2 = 0, far2 = 0;
  std::size_t near = 0, far = 0;
  for (std::size_t i = 0; i < 60; ++i) {
    const LaserScan a = exact.scan(i).measured, b = noisy.scan(i).measured, c = rounded.scan(i).measured;
    for (std::size_t beam = 0; beam < a.size(); ++beam) {
      if (!a.is_return(beam) || !b.is_return(beam)) continue;
      const auto range = static_cast<double>(a.ranges_m[beam]);
      const double error = static_cast<double>(b.ranges_m[beam]) - range;
      (range > 10 ? far2 : near2) += error * error;
      ++(range > 10 ? far : near);
      const auto read = static_cast<double>(c.ranges_m[beam]);
      EXPECT_NEAR(read, range, 0.00051);
      EXPECT_NEAR(read, std::round(read * 1000) / 1000, 1e-6);
    }
  }
  EXPECT_NEAR(std::sqrt(near2 / static_cast<double>(near)), params.laser.range_sigma_m, 0.0003);
  EXPECT_NEAR(std::sqrt(far2 / static_cast<double>(far)), params.laser.kRangeSigmaFar_m, 0.002);
}

TEST(LaserSensor, RollingSweepIsInTheStampsAndInTheRanges) {
  LaserSimulationParams params = perfect(WorldKind::kRoom);
  const LaserSimulation rolling(params);
  params.laser_effects.rolling_sweep = false;
  const LaserSimulation frozen(params);
  const LaserScan a = rolling.scan(500).measured, b = frozen.scan(500).measured;
  EXPECT_EQ(a.stamp, b.stamp);
  EXPECT_NEAR(a.time_increment_s * 1080, 0.75 * 0.025, 1e-12);
  EXPECT_EQ(b.time_increment_s, 0);
  EXPECT_FALSE(same(a, b));
  for (std::size_t beam = 60; beam < 1020; beam += 40)  // beam_ray() goes by the stamps
    EXPECT_NEAR(static_cast<double>(b.ranges_m[beam]), traced_range(beam_ray(frozen, b, beam)).value_or(0),
                0.01);
}

TEST(LaserSensor, GlassAndBlackSurfaces) {
  World world{"box", {}};
  const auto wall = [&](double x, Material material) {
    world.parts.push_back({std::move(material), {}});
    TriangleMesh& mesh = world.parts.back().mesh;
    const auto f = static_cast<float>(x);
    mesh.vertices = {{f, -50, -50}, {f, 50, -50}, {f, 0, 50}};
    mesh.triangles = {{0, 1, 2}};
  };
  Material glass{"glass"}, black{"black"};
  glass.reflectance = black.reflectance = Reflectance::kNoReturn;
  glass.clear = true;
  wall(2, glass);
  wall(5, Material{"plain"});
  wall(-3, black);
  const Renderer renderer(world);
  LaserSensor::Setup setup;
  setup.effects = {false, false, false, true, false};
  const auto origin = [](double) { return SE3(); };
  const LaserScan scan = LaserSensor(world, renderer, setup).scan(Time{1}, origin, Rng(1));
  EXPECT_NEAR(scan.ranges_m[540], 5, 1e-6);  // straight ahead, through the glass
  EXPECT_EQ(scan.ranges_m[0], LaserScan::kNoReturn);
  setup.effects.material_dropout = false;
  const LaserScan all = LaserSensor(world, renderer, setup).scan(Time{1}, origin, Rng(1));
  EXPECT_NEAR(all.ranges_m[540], 2, 1e-6);
  EXPECT_NEAR(all.ranges_m[0], 3 * std::numbers::sqrt2, 1e-5);
}

/// Far from the world's origin the renderer's single precision finds a pane that a beam passes at a grazing
/// angle again and again, centimetres behind the place where the beam met it.
TEST(LaserSensor, PassesAPaneAtAGrazingAngle) {
  World world;
  const auto plane = [&](float y, const Material& material) {
    TriangleMesh mesh;
    mesh.vertices = {{-1000, y, -5}, {1000, y, -5}, {1000, y, 5}, {-1000, y, 5}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    world.parts.push_back({material, mesh});
  };
  Material glass{"glass"};
  glass.clear = true;
  plane(1000, glass);
  plane(999, Material{"plain"});
  const Renderer renderer(world);
  LaserSensor::Setup setup;
  setup.effects = {false, false, false, true, false};
  const auto origin = [](double) { return SE3(Mat3::Identity(), {0, 1000.00998, 0}); };
  const LaserScan scan = LaserSensor(world, renderer, setup).scan(Time{1}, origin, Rng(1));
  for (std::size_t beam = 200; beam < 530; ++beam)
    EXPECT_NEAR(scan.ranges_m[beam] * std::sin(-scan.angle_rad(beam)), 1.01, 0.01) << beam;
}

}  // namespace
}  // namespace hm
