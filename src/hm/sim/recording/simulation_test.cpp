#include "hm/sim/recording/simulation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hm/core/statistics.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/sim/motion/walk.hpp"

namespace hm {
namespace {

SimulationParams small_room() {
  SimulationParams params;
  params.world = WorldKind::kRoom;
  params.frame_limit = 40;
  return params;
}

bool same(const RgbdFrame& a, const RgbdFrame& b) {
  return a.stamp == b.stamp && std::ranges::equal(a.depth.units.pixels(), b.depth.units.pixels()) &&
         std::ranges::equal(a.color.pixels(), b.color.pixels()) &&
         a.T_world_camera->matrix() == b.T_world_camera->matrix();
}

TEST(Simulation, IsTheSameForEveryRunAndNumberOfThreads) {
  SimulationParams params = small_room();
  params.rolling_shutter = params.pose_drift = true;
  const Simulation a(params), b(params);
  const ParallelLoop two(2);
  std::vector<RgbdFrame> parallel(a.frame_count());
  two.for_ranges(a.frame_count(), 1, [&](std::size_t i, std::size_t) { parallel[i] = a.frame(i); });
  for (std::size_t i = 0; i < a.frame_count(); i += 3) {
    EXPECT_TRUE(same(a.frame(i), b.frame(i, two))) << i;
    EXPECT_TRUE(same(a.frame(i), parallel[i])) << i;
  }
  params.seed = 2;
  EXPECT_FALSE(same(a.frame(3), Simulation(params).frame(3)));
}

TEST(Simulation, WithoutEffectsDepthIsTheRendering) {
  SimulationParams params = small_room();
  params.effects = SensorEffects::none();
  const Simulation simulation(params);
  const Renderer renderer(simulation.world());
  for (const std::size_t i : {0u, 17u, 39u}) {
    const RgbdFrame frame = simulation.frame(i);
    const RenderedView view = renderer.render(simulation.camera(), simulation.true_pose(i), ParallelLoop());
    for (int y = 0; y < 180; ++y) {
      for (int x = 0; x < 320; ++x) {
        const double z = static_cast<double>(view.depth_m(x, y));
        if (z < 0.4 || z > 4.0) continue;
        ASSERT_NEAR(frame.depth.depth_m(x, y), z, 0.51 * kSimulatedDepthUnit_m);
      }
    }
    EXPECT_TRUE(std::ranges::equal(frame.color.pixels(), view.color.pixels()));
  }
}

TEST(Simulation, FramesFollowSensorRateLimitAndStride) {
  SimulationParams params = small_room();
  EXPECT_EQ(Simulation(params).frame_count(), 40u);
  params.frame_limit = 0;
  const Simulation whole(params);
  EXPECT_NEAR(static_cast<double>(whole.frame_count()), room_walk().duration_s() * 5, 2);
  EXPECT_NEAR((whole.stamp(10) - whole.stamp(0)).seconds(), 2.0, 1e-6);
  params.frame_stride = 4;
  const Simulation strided(params);
  EXPECT_EQ(strided.frame_count(), (whole.frame_count() + 3) / 4);
  EXPECT_EQ(strided.true_pose(5).matrix(), whole.true_pose(20).matrix());
  params.frame_stride = 1;
  params.duration_scale_ratio = 0.5;
  EXPECT_NEAR(static_cast<double>(Simulation(params).frame_count()),
              static_cast<double>(whole.frame_count()) / 2, 2);
  params.sensor = SensorPreset::kKinect;
  EXPECT_EQ(Simulation(params).camera().width, 640);
}

TEST(Simulation, RollingShutterMovesRowsByTheirExposureTimes) {
  SimulationParams params = small_room();
  const Simulation global(params);
  params.rolling_shutter = true;
  params.readout_s = 0;
  const Simulation instant(params);
  params.readout_s = 0.1;
  const Simulation rolling(params);
  const auto differing_pixels = [&](const Image<Rgb8>& a, const Image<Rgb8>& b, int from, int to) {
    int count = 0;
    for (int y = from; y < to; ++y)
      for (int x = 0; x < 320; ++x) count += std::abs(a(x, y).g - b(x, y).g) > 8;
    return count;
  };
  const Image<Rgb8> still = global.frame(20).color, moved = rolling.frame(20).color;
  EXPECT_LT(differing_pixels(still, instant.frame(20).color, 0, 180), 60);  // float against double hit points
  EXPECT_GT(differing_pixels(still, moved, 0, 20), 300);
  EXPECT_LT(differing_pixels(still, moved, 88, 92), differing_pixels(still, moved, 0, 4) / 3);
  // The first row is what the camera saw half the read-out time before.
  const Renderer renderer(rolling.world());
  const Walk walk = room_walk();
  const SE3 early = walk.T_world_camera(20 * 0.2 - 0.05);
  const Image<Rgb8> first = renderer.render(rolling.camera(), early, ParallelLoop()).color;
  EXPECT_LT(differing_pixels(first, moved, 0, 1), 16);
  EXPECT_TRUE(
      std::ranges::equal(global.frame(20).depth.units.pixels(), rolling.frame(20).depth.units.pixels()));
}

TEST(Simulation, DriftIsSmoothLevelAndOfTheSizeAskedFor) {
  SimulationParams params;
  params.world = WorldKind::kCorridor;
  std::vector<double> at_end;
  double path = 0;
  for (params.seed = 1; params.seed <= 60; ++params.seed) {
    params.pose_drift = true;
    const Simulation simulation(params);
    EXPECT_EQ(simulation.reported_pose(0).matrix(), simulation.true_pose(0).matrix());
    Vec3 before = Vec3::Zero();
    path = 0;
    for (std::size_t i = 1; i < simulation.frame_count(); ++i) {
      const SE3 truth = simulation.true_pose(i), reported = simulation.reported_pose(i);
      const Vec3 error = reported.translation() - truth.translation();
      const double step = (truth.translation() - simulation.true_pose(i - 1).translation()).norm();
      path += step;
      ASSERT_LT((error - before).norm(), 0.1 * step + 1e-9);                 // never a jump
      ASSERT_NEAR(reported.rotation()(2, 2), truth.rotation()(2, 2), 1e-9);  // pitch is right
      before = error;
    }
    at_end.push_back(before.norm() / path);
  }
  // A velocity error of 0.5 % that forgets itself every 8 m, and yaw on the way out and back.
  const Summary summary = summarise(at_end);
  EXPECT_GT(summary.rmse, 0.002);
  EXPECT_LT(summary.rmse, 0.010);
  EXPECT_NEAR(path, 56, 1);
  params.pose_drift = false;
  const Simulation exact(params);
  EXPECT_EQ(exact.reported_pose(100).matrix(), exact.true_pose(100).matrix());
  EXPECT_EQ(exact.frame(100).T_world_camera->matrix(), exact.true_pose(100).matrix());
}

TEST(Simulation, VisibleTruthReachesAsFarAsTheSensorOrAsAskedFor) {
  SimulationParams params;
  params.world = WorldKind::kRoom;
  params.frame_limit = 40;
  const auto farthest_m = [&](double truth_far_m) {
    params.truth_far_m = truth_far_m;
    const Simulation simulation(params);
    double farthest = 0;
    for (const Eigen::Vector3f& p : simulation.visible_truth(ParallelLoop(2)).positions) {
      double nearest_view = 1e9;
      for (std::size_t i = 0; i < simulation.frame_count(); ++i) {
        const Vec3 p_camera = simulation.true_pose(i).inverse() * p.cast<double>();
        if (simulation.camera().contains(simulation.camera().project(p_camera)) && p_camera.z() > 0.4)
          nearest_view = std::min(nearest_view, p_camera.z());
      }
      farthest = std::max(farthest, nearest_view);
    }
    return farthest;
  };
  const double of_sensor = farthest_m(0);
  EXPECT_GT(of_sensor, 2.0);
  EXPECT_LE(of_sensor, sensor_model(params.sensor).max_depth_m);
  EXPECT_EQ(farthest_m(100), of_sensor);
  EXPECT_GT(farthest_m(1.5), 1.4);
  EXPECT_LE(farthest_m(1.5), 1.5);
}

TEST(Simulation, ParametersAreNamedAndChecked) {
  SimulationParams params;
  ParamList list;
  list.add("sim", params);
  ASSERT_TRUE(list.set("sim.world=room"));
  ASSERT_TRUE(list.set("sim.sensor=kinect"));
  ASSERT_TRUE(list.set("sim.axial_noise=false"));
  EXPECT_EQ(params.world, WorldKind::kRoom);
  EXPECT_EQ(params.sensor, SensorPreset::kKinect);
  EXPECT_FALSE(params.effects.axial_noise);
  const auto wrong = list.set("sim.sensr=kinect");
  ASSERT_FALSE(wrong);
  EXPECT_NE(wrong.error().message.find("sim.sensor"), std::string::npos);
  EXPECT_FALSE(list.set("sim.frame_stride=0") && list.check());
}

}  // namespace
}  // namespace hm
