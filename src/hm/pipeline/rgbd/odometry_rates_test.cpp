// Visual odometry (dissertation 3.2) at other image sizes and rates than a Kinect's own, in the simulated
// room with exact truth.
#include <gtest/gtest.h>

#include <algorithm>

#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/odometry/make_odometry.hpp"
#include "hm/sim/recording/simulation.hpp"

namespace hm {
namespace {

/// Every second pixel of the depth, colours averaged.
RgbdFrame halved(const RgbdFrame& frame) {
  RgbdFrame half = frame;
  const int width = frame.depth.width() / 2, height = frame.depth.height() / 2;
  half.depth.units = Image<std::uint16_t>(width, height);
  half.color = Image<Rgb8>(width, height);
  const auto mean = [](int a, int b, int c, int d) {
    return static_cast<std::uint8_t>((a + b + c + d + 2) / 4);
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      half.depth.units(x, y) = frame.depth.units(2 * x, 2 * y);
      const Rgb8 &a = frame.color(2 * x, 2 * y), &b = frame.color(2 * x + 1, 2 * y),
                 &c = frame.color(2 * x, 2 * y + 1), &d = frame.color(2 * x + 1, 2 * y + 1);
      half.color(x, y) = {mean(a.r, b.r, c.r, d.r), mean(a.g, b.g, c.g, d.g), mean(a.b, b.b, c.b, d.b)};
    }
  return half;
}

struct Drift {
  double worst_m = 0, path_m = 0;
  int lost = 0;
};

/// Tracks the walk through the room, from a frame to the last.
Drift walk(const SimulationParams& params, bool half_size, std::size_t first = 0) {
  const Simulation simulation(params);
  const PinholeCamera camera = half_size ? simulation.camera().scaled(0.5) : simulation.camera();
  const auto odometry = make_visual_odometry({}, camera, simulation.true_pose(first));
  Drift drift;
  for (std::size_t i = first; i < simulation.frame_count(); ++i) {
    const RgbdFrame frame = simulation.frame(i);
    const TrackedFrame tracked = odometry->track(half_size ? halved(frame) : frame);
    const Vec3 truth = simulation.true_pose(i).translation();
    if (i > first) drift.path_m += (truth - simulation.true_pose(i - 1).translation()).norm();
    if (tracked.T_odom_camera)
      drift.worst_m = std::max(drift.worst_m, (tracked.T_odom_camera->translation() - truth).norm());
    else
      ++drift.lost;
  }
  return drift;
}

/// Nothing is lost on the way, and the worst error is less than this share of it.
void expect_drift_below(double ratio, const Drift& drift) {
  testing::Test::RecordProperty("worst_mm", std::to_string(1000 * drift.worst_m));
  EXPECT_EQ(drift.lost, 0);
  EXPECT_GT(drift.path_m, 3);
  EXPECT_LT(drift.worst_m, ratio * drift.path_m);
}

/// 320 x 180 pixels at 5 Hz, twice a Kinect's noise, and a wallpaper whose columns repeat by less than the
/// camera moves from frame to frame: earlier the odometry went from one column to the next without a word.
TEST(OdometryRates, FollowsATabletAtFiveHertzPastWallpaper) {
  SimulationParams params;
  params.world = WorldKind::kRoom;
  params.frame_limit = 70;
  expect_drift_below(0.03, walk(params, false));
}

/// The camera steps back from two papered walls, 15 cm from frame to frame: brightness fits a column further
/// as well as the truth, so that the tablet was lost for the rest of the walk (seed 1) or jumped without a
/// word (seed 2). The walls themselves, as surfaces, leave no doubt.
TEST(OdometryRates, FollowsATabletThatStepsBackFromPaperedWalls) {
  for (const int seed : {1, 2}) {
    SimulationParams params;
    params.world = WorldKind::kRoom;
    params.seed = seed;
    params.frame_limit = 225;
    expect_drift_below(0.03, walk(params, false, 128));
  }
}

TEST(OdometryRates, FollowsAHalvedKinectAtFiveHertz) {
  SimulationParams params;
  params.world = WorldKind::kRoom;
  params.sensor = SensorPreset::kKinect;
  params.frame_stride = 6;
  params.frame_limit = 50;
  expect_drift_below(0.01, walk(params, true));
}

}  // namespace
}  // namespace hm
