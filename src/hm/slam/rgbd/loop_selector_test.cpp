#include "hm/slam/rgbd/loop_selector.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
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
TEST(LoopSelector, CorridorOfIdenticalDoors) {
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

/// Out along x and back again, a keyframe every metre: the last one stands where the first one stood.
KeyframeGraph out_and_back(const RgbdLoopParams& params) {
  KeyframeGraph graph(params);
  for (int i = 0; i <= 20; ++i) {
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->stamp = Time::from_seconds(i);
    keyframe->T_odom_camera = SE3(Mat3::Identity(), Vec3(i <= 10 ? i : 20 - i, 0, 0));
    graph.add(std::move(keyframe));
  }
  return graph;
}

/// The newest keyframe is said to stand `shift_m` beyond where `from` stands.
LoopProposal proposal(const KeyframeGraph& graph, std::size_t from, double shift_m, int inliers) {
  LoopProposal p;
  p.from = from, p.to = graph.size() - 1;
  p.match.outcome = PlaceOutcome::kSamePlace;
  p.match.inliers = inliers;
  p.match.T_a_b = SE3(Mat3::Identity(), Vec3(shift_m, 0, 0));
  p.match.covariance = 1e-6 * Mat6::Identity();
  return p;
}

TEST(LoopSelector, ALoopMustBeWhereOdometryAllowsIt) {
  const RgbdLoopParams params;
  const KeyframeGraph graph = out_and_back(params);
  const LoopDecision near = LoopSelector(params).update(graph, {proposal(graph, 0, 0.1, 100)});
  EXPECT_EQ(near.accepted.size(), 1U);
  const LoopDecision far = LoopSelector(params).update(graph, {proposal(graph, 0, 8, 100)});
  EXPECT_TRUE(far.accepted.empty());
  EXPECT_EQ(far.too_far, 1U);
}

/// Two doors that look the same, a metre apart, both where odometry allows: neither is accepted, unless one
/// explains far less.
TEST(LoopSelector, RivalsAreBothRefused) {
  const RgbdLoopParams params;
  const KeyframeGraph graph = out_and_back(params);
  const auto best = proposal(graph, 0, 0.1, 100);
  for (const int inliers : {100, 80, 61}) {
    const LoopDecision decision =
        LoopSelector(params).update(graph, {best, proposal(graph, 1, 0.1, inliers)});
    EXPECT_TRUE(decision.accepted.empty()) << inliers;
    EXPECT_EQ(decision.ambiguous, 2U);
    EXPECT_EQ(decision.too_far, 0U);
  }
  const LoopDecision weak = LoopSelector(params).update(graph, {best, proposal(graph, 1, 0.1, 59)});
  ASSERT_EQ(weak.accepted.size(), 1U);
  EXPECT_EQ(weak.accepted.front().from, 0U);
  // Another keyframe of the same door is no rival.
  const LoopDecision same = LoopSelector(params).update(graph, {best, proposal(graph, 1, -0.9, 100)});
  EXPECT_EQ(same.accepted.size(), 2U);
}

TEST(LoopSelector, ALargeCorrectionWaitsForAnotherKeyframe) {
  const RgbdLoopParams params;
  KeyframeGraph graph = out_and_back(params);
  LoopSelector selector(params);
  EXPECT_TRUE(selector.update(graph, {proposal(graph, 0, 0.6, 100)}).accepted.empty());
  EXPECT_EQ(selector.waiting(), 1U);
  auto next = std::make_shared<Keyframe>();
  next->stamp = Time::from_seconds(21);
  next->T_odom_camera = SE3(Mat3::Identity(), Vec3(-1, 0, 0));
  graph.add(std::move(next));
  EXPECT_TRUE(selector.update(graph, {proposal(graph, 0, -2, 100)}).accepted.empty())
      << "says something else";
  EXPECT_EQ(selector.update(graph, {proposal(graph, 0, -0.4, 100)}).accepted.size(), 2U);
}

}  // namespace
}  // namespace hm
