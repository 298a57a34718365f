#include "hm/sim/recording/simulation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
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
  params.flaws = "all";
  params.frame_limit = 10;
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

/// Room, frames of a walk that has begun; with these flaws, or without.
Simulation walk_with(const std::string& flaws, double duration_scale_ratio = 1) {
  SimulationParams params = small_room();
  params.flaws = flaws;
  params.duration_scale_ratio = duration_scale_ratio;
  return Simulation(params);
}

double mean_difference(const Image<Rgb8>& a, const Image<Rgb8>& b, int from_row, int to_row) {
  double sum = 0;
  for (int y = from_row; y < to_row; ++y)
    for (int x = 0; x < a.width(); ++x) sum += std::abs(int{a(x, y).g} - int{b(x, y).g});
  return sum / (a.width() * (to_row - from_row));
}

Image<Rgb8> color_from(const Simulation& simulation, const PinholeCamera& camera, const SE3& pose) {
  return Renderer(simulation.world()).render(camera, pose, ParallelLoop()).color;
}

constexpr std::size_t kAt = 20;  // the frame 4 s after the first

bool same_depth(const Simulation& a, const Simulation& b) {
  return std::ranges::equal(a.frame(kAt).depth.units.pixels(), b.frame(kAt).depth.units.pixels());
}

TEST(Simulation, WithoutFlawsFramesAreThoseOfTheSensorAlone) {
  const Simulation simulation = walk_with("");
  const Renderer renderer(simulation.world());
  for (const std::size_t i : {0u, 7u, 39u}) {
    const RenderedView view = renderer.render(simulation.camera(), simulation.true_pose(i), ParallelLoop());
    Rng rng(1, i);
    const DepthImage depth = sense_depth(simulation.sensor(), simulation.params().effects, view, rng);
    const RgbdFrame frame = simulation.frame(i);
    EXPECT_TRUE(std::ranges::equal(frame.depth.units.pixels(), depth.units.pixels()));
    EXPECT_TRUE(std::ranges::equal(frame.color.pixels(), view.color.pixels()));
    EXPECT_EQ(frame.T_world_camera->matrix(), simulation.true_pose(i).matrix());
  }
}

TEST(Simulation, RollingShutterMovesRowsByTheirExposureTimes) {
  const Simulation ideal = walk_with(""), rolling = walk_with("rolling_shutter");
  const Walk walk = room_walk();
  const double readout_s = rolling.flaws().readout_s;
  const Image<Rgb8> color = rolling.frame(kAt).color;
  const Image<Rgb8> first = color_from(rolling, rolling.camera(), walk.T_world_camera(4 - readout_s / 2));
  const Image<Rgb8> last = color_from(rolling, rolling.camera(), walk.T_world_camera(4 + readout_s / 2));
  const int height = color.height();
  EXPECT_LT(mean_difference(color, first, 0, 1), 0.01);
  EXPECT_LT(mean_difference(color, last, height - 1, height), 0.01);
  EXPECT_GT(mean_difference(color, last, 0, 20), 0.5);
  EXPECT_TRUE(same_depth(ideal, rolling));
}

TEST(Simulation, BlurIsTheMeanOverTheExposureTime) {
  // Four times as fast, so that the blur is longer than a pixel.
  const Simulation ideal = walk_with("", 0.25), blurred = walk_with("blur", 0.25);
  const auto roughness = [](const Image<Rgb8>& image) {
    double sum = 0;
    for (int y = 0; y < image.height(); ++y)
      for (int x = 1; x < image.width(); ++x) sum += std::abs(int{image(x, y).g} - int{image(x - 1, y).g});
    return sum;
  };
  EXPECT_LT(roughness(blurred.frame(kAt).color), 0.95 * roughness(ideal.frame(kAt).color));
  EXPECT_TRUE(same_depth(ideal, blurred));
  EXPECT_LT(mean_difference(blurred.frame(0).color, ideal.frame(0).color, 0, 180), 0.6);  // it stands still
}

TEST(Simulation, TimeOffsetDelaysColourButNotItsStamp) {
  const Simulation ideal = walk_with(""), late = walk_with("time_offset");
  const RgbdFrame frame = late.frame(kAt);
  const SE3 pose = room_walk().T_world_camera(4 + late.flaws().color_delay_s);
  EXPECT_LT(mean_difference(frame.color, color_from(late, late.camera(), pose), 0, 180), 0.01);
  EXPECT_GT(mean_difference(frame.color, ideal.frame(kAt).color, 0, 180), 0.2);
  EXPECT_EQ(frame.color_stamp, frame.stamp);
  EXPECT_EQ(frame.stamp, ideal.frame(kAt).stamp);
  EXPECT_TRUE(same_depth(ideal, late));
}

TEST(Simulation, RegistrationShiftsColourAgainstDepth) {
  const Simulation ideal = walk_with(""), shifted = walk_with("registration");
  const FlawSizes& sizes = shifted.flaws();
  PinholeCamera camera = shifted.camera();
  camera.cx += sizes.color_shift_x_px;
  camera.cy += sizes.color_shift_y_px;
  const SE3 pose = shifted.true_pose(kAt) * SE3(Mat3::Identity(), Vec3(sizes.color_baseline_m, 0, 0));
  const Image<Rgb8> color = shifted.frame(kAt).color;
  EXPECT_LT(mean_difference(color, color_from(shifted, camera, pose), 0, 180), 0.01);
  EXPECT_GT(mean_difference(color, ideal.frame(kAt).color, 0, 180), 0.5);
  EXPECT_TRUE(same_depth(ideal, shifted));
}

TEST(Simulation, IntrinsicsAreNotThoseThatTheRecordingStates) {
  SimulationParams params = small_room();
  params.effects = SensorEffects::none();
  params.flaws = "intrinsics";
  const Simulation off(params);
  const PinholeCamera stated = sensor_model(params.sensor).camera;
  EXPECT_EQ(off.camera().fx, stated.fx);
  PinholeCamera camera = stated;
  camera.fx *= 1 + off.flaws().focal_x_ratio;
  camera.fy *= 1 + off.flaws().focal_y_ratio;
  camera.cx += off.flaws().center_x_ratio * stated.width;
  camera.cy += off.flaws().center_y_ratio * stated.width;
  const RenderedView view = Renderer(off.world()).render(camera, off.true_pose(kAt), ParallelLoop());
  const RgbdFrame frame = off.frame(kAt);
  EXPECT_TRUE(std::ranges::equal(frame.color.pixels(), view.color.pixels()));
  for (int x = 0; x < 320; ++x)
    if (frame.depth.units(x, 90) != 0) {
      ASSERT_NEAR(frame.depth.depth_m(x, 90), view.depth_m(x, 90), 2e-4);
    }
}

/// Asserts that depth with these flaws is `reading` of what it is without, at every pixel.
template <class Reading>
void expect_depth_is(SimulationParams params, const char* flaws, const Reading& reading) {
  params.effects = SensorEffects::none();
  params.effects.depth_bias = true;
  const Simulation ideal(params);
  params.flaws = flaws;
  const Simulation flawed(params);
  const DepthImage before = ideal.frame(kAt).depth, after = flawed.frame(kAt).depth;
  double largest_m = 0;
  for (int y = 0; y < 180; ++y)
    for (int x = 0; x < 320; ++x) {
      ASSERT_EQ(after.units(x, y) == 0, before.units(x, y) == 0);
      if (before.units(x, y) == 0) continue;
      ASSERT_NEAR(after.depth_m(x, y), reading(flawed.flaws(), x, y, before.depth_m(x, y)), 3e-4);
      largest_m = std::max(largest_m, std::abs(after.depth_m(x, y) - before.depth_m(x, y)));
    }
  EXPECT_GT(largest_m, 0.002);
  EXPECT_TRUE(std::ranges::equal(ideal.frame(kAt).color.pixels(), flawed.frame(kAt).color.pixels()));
}

TEST(Simulation, DepthBendsWithDistanceInEitherSense) {
  bool nearer_corners = false, farther_corners = false;
  SimulationParams params = small_room();
  for (params.seed = 1; !nearer_corners || !farther_corners; ++params.seed) {
    ASSERT_LT(params.seed, 20);
    expect_depth_is(params, "depth_bend", [&](const FlawSizes& sizes, int x, int y, double depth_m) {
      (sizes.bend_at_3m_m < 0 ? nearer_corners : farther_corners) = true;
      SensorModel sensor = sensor_model(params.sensor);
      sensor.bias_at_3m_m = sizes.bend_at_3m_m;
      return depth_m + depth_bias_m(sensor, x, y, depth_m);
    });
  }
}

TEST(Simulation, NearDepthIsShort) {
  expect_depth_is(small_room(), "short_depth", [](const FlawSizes&, int, int, double depth_m) {
    return 1 / (1.06 / depth_m - 0.02);  // 4 % at 1 m, none at 3 m
  });
}

TEST(Simulation, DepthGrainChangesTheNoiseOfDepthOnly) {
  const Simulation ideal = walk_with(""), grain = walk_with("depth_grain");
  EXPECT_FALSE(same_depth(ideal, grain));
  EXPECT_TRUE(std::ranges::equal(ideal.frame(kAt).color.pixels(), grain.frame(kAt).color.pixels()));
}

TEST(Simulation, UnregisteredColourIsThatOfAWiderCameraBeside) {
  const Simulation ideal = walk_with(""), beside = walk_with("unregistered");
  PinholeCamera camera = beside.camera();
  camera.fx *= 0.9, camera.fy *= 0.9;
  const SE3 pose = beside.true_pose(kAt) * SE3(Mat3::Identity(), Vec3(0.03, 0, 0));
  EXPECT_LT(mean_difference(beside.frame(kAt).color, color_from(beside, camera, pose), 0, 180), 0.01);
  EXPECT_TRUE(same_depth(ideal, beside));
}

TEST(Simulation, ExposureAndWhiteBalanceFollowTheSceneWithADelay) {
  const Simulation ideal = walk_with(""), exposed = walk_with("exposure");
  std::vector<double> red;
  for (const std::size_t i : {0u, 10u, 20u, 30u, 39u}) {
    const Image<Rgb8> before = ideal.frame(i).color, after = exposed.frame(i).color;
    std::array<std::vector<double>, 3> ratios;
    for (std::size_t k = 0; k < before.pixels().size(); ++k) {
      const Rgb8 a = before.pixels()[k], b = after.pixels()[k];
      if (a.r < 60 || a.g < 60 || a.b < 60 || b.r == 255 || b.g == 255 || b.b == 255) continue;
      ratios[0].push_back(1.0 * b.r / a.r), ratios[1].push_back(1.0 * b.g / a.g);
      ratios[2].push_back(1.0 * b.b / a.b);
    }
    ASSERT_GT(ratios[0].size(), 1000u);
    for (const auto& of_channel : ratios) {  // one factor for a whole image
      const Summary summary = summarise(of_channel);
      EXPECT_LT(summary.max - summary.min, 0.04) << i;
    }
    red.push_back(summarise(ratios[0]).mean);
  }
  EXPECT_GT(std::ranges::max(red) - std::ranges::min(red), 0.02);
  EXPECT_TRUE(same_depth(ideal, exposed));
}

TEST(Simulation, PeopleHideWhatIsBehindThem) {
  SimulationParams params = small_room();
  params.effects = SensorEffects::none();
  params.frame_limit = 0;
  const Simulation empty(params);
  params.flaws = "people";
  const Simulation peopled(params);
  std::size_t hidden = 0, frames = 0;
  for (std::size_t i = 0; i < peopled.frame_count(); i += 10, ++frames) {
    const RgbdFrame before = empty.frame(i), after = peopled.frame(i);
    std::size_t here = 0;
    for (std::size_t k = 0; k < before.color.pixels().size(); ++k) {
      const std::uint16_t a = before.depth.units.pixels()[k], b = after.depth.units.pixels()[k];
      here += a != b;
      ASSERT_TRUE(a == b || a == 0 || b < a);
    }
    hidden += here > 500;
  }
  EXPECT_GT(hidden, frames / 20);
  EXPECT_LT(hidden, frames);
}

TEST(Simulation, WheelsThatSlipReportOtherPosesThanTheTrueOnes) {
  const Simulation ideal = walk_with(""), slipping = walk_with("wheel_slip");
  EXPECT_FALSE(ideal.has_reported_poses());
  EXPECT_TRUE(slipping.has_reported_poses());
  EXPECT_EQ(slipping.true_pose(39).matrix(), ideal.true_pose(39).matrix());
  EXPECT_GT((slipping.reported_pose(39).translation() - ideal.true_pose(39).translation()).norm(), 0.02);
  EXPECT_EQ(slipping.frame(39).T_world_camera->matrix(), slipping.reported_pose(39).matrix());
  EXPECT_TRUE(std::ranges::equal(ideal.frame(kAt).color.pixels(), slipping.frame(kAt).color.pixels()));
}

TEST(Simulation, GlassOfTheHouseIsSeenThrough) {
  SimulationParams params;
  params.frame_stride = 40;
  const Simulation ideal(params);
  params.flaws = "glass";
  const Simulation glass(params);
  std::size_t changed = 0;
  for (std::size_t i = 0; i < ideal.frame_count(); ++i)
    changed += !std::ranges::equal(ideal.frame(i).color.pixels(), glass.frame(i).color.pixels());
  EXPECT_GT(changed, 3u);
  EXPECT_LT(changed, ideal.frame_count());
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
