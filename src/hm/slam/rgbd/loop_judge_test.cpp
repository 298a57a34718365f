#include "hm/slam/rgbd/loop_judge.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hm/slam/rgbd/rgbd_loop_closer.hpp"
#include "hm/slam/rgbd/testing/landmark_world.hpp"

namespace hm {
namespace {

/// Loops of the graph whose motion differs from the truth.
int false_loops(const PoseGraph3D& graph, const std::vector<SE3>& truth) {
  int count = 0;
  for (const PoseEdge3D& edge : graph.edges) {
    if (edge.kind != PoseEdgeKind::kLoop) continue;
    const SE3 error = edge.T_from_to.inverse() * (truth[edge.from].inverse() * truth[edge.to]);
    count += error.translation().norm() > 0.3 || error.angle() > 0.1 ? 1 : 0;
  }
  return count;
}

double worst_m(const CorrectedKeyframes& corrected, const std::vector<SE3>& truth) {
  double worst = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    worst = std::max(worst,
                     (corrected.keyframes()[i].T_map_camera.translation() - truth[i].translation()).norm());
  return worst;
}

/// There and back along x, twice, looking ahead; turning in place at the ends.
std::vector<SE3> to_and_fro(double length_m, int times) {
  std::vector<SE3> way;
  for (int t = 0; t < times; ++t) {
    const bool back = t % 2 == 1;
    for (double x = 0; x < length_m; x += 0.4)
      way.push_back(test::level_camera(back ? length_m - x : x, 0, back ? std::numbers::pi : 0));
    for (int i = 1; i < 8; ++i)
      way.push_back(test::level_camera(back ? 0 : length_m, 0,
                                       (back ? std::numbers::pi : 0) + i * std::numbers::pi / 8));
  }
  return way;
}

/// A corridor of identical doors: every 1.5 m everything looks the same. No door is taken for another one,
/// whatever the drift, though every view has perfect matches elsewhere.
TEST(LoopJudge, CorridorOfIdenticalDoors) {
  for (const double drift_rad_m : {0.0, 0.001, 0.003}) {
    Rng rng(1);
    const test::LandmarkWorld world = test::periodic_corridor(27, 1.5, 60, rng);
    const test::KeyframesOfWay way = test::walk(world, to_and_fro(18, 4), drift_rad_m, rng);
    RgbdLoopParams params;
    params.bundle_adjustment = false;
    RgbdLoopCloser closer(test::landmark_camera(), params);
    for (const auto& keyframe : way.keyframes) closer.add(keyframe);
    double odometry_m = 0;
    for (std::size_t i = 0; i < way.truth.size(); ++i)
      odometry_m = std::max(
          odometry_m, (way.keyframes[i]->T_odom_camera.translation() - way.truth[i].translation()).norm());
    closer.finish();
    const RgbdLoopStatistics loops = closer.statistics();
    EXPECT_EQ(false_loops(closer.graph(), way.truth), 0);
    EXPECT_LT(worst_m(closer.corrected(), way.truth), 0.05 + 0.2 * odometry_m);
    EXPECT_GT(loops.accepted, 5U);
    EXPECT_GT(loops.too_far + loops.ambiguous, 100U);
  }
}

}  // namespace
}  // namespace hm
