#include "hm/slam/pose_graph/pose_graph_2d_solver.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <numbers>

#include "hm/core/rng.hpp"
#include "hm/slam/pose_graph/pose_uncertainty.hpp"
#include "hm/slam/pose_graph/testing/whole_graph.hpp"

namespace hm {
namespace {

SE2 random_pose(Rng& rng, double size = 3) {
  return {rng.uniform(-size, size), rng.uniform(-size, size), rng.uniform(-3, 3)};
}

TEST(PoseGraphSolver, JacobianAgainstDifferences) {
  Rng rng(1);
  for (int trial = 0; trial < 50; ++trial) {
    const SE2 from = random_pose(rng), to = random_pose(rng);
    PoseEdge2D edge;
    edge.T_from_to = from.inverse() * to * SE2(rng.normal(), rng.normal(), rng.uniform(-1, 1));
    const auto jacobian = pose_edge_jacobian(edge, from, to);
    constexpr double kStep = 1e-6;
    for (int k = 0; k < 6; ++k) {
      const auto error = [&](double step) {
        Vec3 a = from.vector(), b = to.vector();
        (k < 3 ? a[k] : b[k - 3]) += step;
        return pose_edge_error(edge, SE2(a.x(), a.y(), a.z()), SE2(b.x(), b.y(), b.z()));
      };
      EXPECT_LT(((error(kStep) - error(-kStep)) / (2 * kStep) - jacobian.col(k)).norm(), 1e-6);
    }
  }
}

/// A noisy square driven four times with loops at each corner: with exact edges the solver finds the true
/// poses.
PoseGraph2D square(double noise, std::vector<SE2>& truth) {
  Rng rng(2);
  PoseGraph2D graph;
  SE2 T;
  for (int i = 0; i < 80; ++i) {
    truth.push_back(T);
    T = T * (i % 5 == 4 ? SE2(1, 0, std::numbers::pi / 2) : SE2(1, 0, 0));
  }
  const auto add = [&](std::size_t a, std::size_t b, PoseEdgeKind kind) {
    graph.edges.push_back(
        {a, b,
         truth[a].inverse() * truth[b] * SE2::exp(noise * Vec3(rng.normal(), rng.normal(), rng.normal())),
         Vec3(100, 100, 400).asDiagonal(), kind});
  };
  for (std::size_t i = 0; i + 1 < 80; ++i) add(i, i + 1, PoseEdgeKind::kOdometry);
  for (std::size_t i = 0; i + 20 < 80; i += 5) add(i, i + 20, PoseEdgeKind::kLoop);
  graph.T_map_node.push_back(truth[0]);
  for (std::size_t i = 0; i + 1 < 80; ++i)
    graph.T_map_node.push_back(graph.T_map_node.back() * graph.edges[i].T_from_to *
                               SE2(rng.normal(0, 0.02), rng.normal(0, 0.02), rng.normal(0, 0.01)));
  return graph;
}

TEST(PoseGraphSolver, ExactEdgesGiveTheTruth) {
  std::vector<SE2> truth;
  PoseGraph2D graph = square(0, truth);
  const PoseGraphSolution solution = solve_pose_graph(graph);
  EXPECT_TRUE(solution.converged) << solution.message;
  EXPECT_GT(solution.initial_chi2, 1);
  EXPECT_LT(solution.final_chi2, 1e-8);
  for (std::size_t i = 0; i < truth.size(); ++i)
    EXPECT_LT((truth[i].inverse() * graph.T_map_node[i]).vector().norm(), 1e-5);
}

TEST(PoseGraphSolver, OptimumIsAMinimumAndDeterministic) {
  std::vector<SE2> truth;
  PoseGraph2D graph = square(0.05, truth), again = graph;
  EXPECT_TRUE(solve_pose_graph(graph).converged);
  solve_pose_graph(again);
  for (std::size_t i = 0; i < truth.size(); ++i)
    EXPECT_EQ(graph.T_map_node[i].vector(), again.T_map_node[i].vector());
  EXPECT_EQ(graph.T_map_node[0].vector(), truth[0].vector());
  Rng rng(3);
  const double least = pose_graph_chi2(graph);
  for (int trial = 0; trial < 200; ++trial) {
    PoseGraph2D moved = graph;
    SE2& node = moved.T_map_node[1 + rng.below(79)];
    node = node * SE2(rng.normal(0, 1e-3), rng.normal(0, 1e-3), rng.normal(0, 1e-3));
    EXPECT_GT(pose_graph_chi2(moved), least - 1e-6);
  }
}

/// One loop in nine is false: the robust loss keeps the error within centimetres, least squares does not.
TEST(PoseGraphSolver, FalseLoopLosesItsInfluence) {
  const auto worst_error_m = [](double loss_chi2) {
    std::vector<SE2> truth;
    PoseGraph2D graph = square(0, truth);
    graph.edges.push_back({10, 70, SE2(0.5, 3, 1), Vec3(100, 100, 400).asDiagonal(), PoseEdgeKind::kLoop});
    solve_pose_graph(graph, {200, loss_chi2});
    double worst = 0;
    for (std::size_t i = 0; i < truth.size(); ++i)
      worst = std::max(worst, (truth[i].inverse() * graph.T_map_node[i]).translation().norm());
    return worst;
  };
  EXPECT_GT(worst_error_m(0), 0.5);
  EXPECT_LT(worst_error_m(1), 0.1);
}

TEST(PoseGraphSolver, DegenerateGraphs) {
  PoseGraph2D graph;
  EXPECT_TRUE(solve_pose_graph(graph).converged);
  graph.T_map_node = {SE2(1, 2, 3), SE2(4, 5, 6), SE2(7, 8, 9)};
  EXPECT_TRUE(solve_pose_graph(graph).converged);
  graph.edges.push_back(
      {1, 2, SE2(1, 0, 0), Mat3::Identity(), PoseEdgeKind::kOdometry});  // not connected to the rest
  const PoseGraphSolution apart = solve_pose_graph(graph);
  EXPECT_LT(apart.final_chi2, 1e-6);
  EXPECT_EQ(graph.T_map_node[0].vector(), SE2(1, 2, 3).vector());
  graph.edges[0].information.setZero();
  solve_pose_graph(graph);
  EXPECT_TRUE(graph.T_map_node[2].vector().allFinite());
  graph.edges[0].information(0, 0) = std::numeric_limits<double>::quiet_NaN();
  const PoseGraph2D before = graph;
  EXPECT_FALSE(solve_pose_graph(graph).converged);
  EXPECT_EQ(graph.T_map_node[2].vector(), before.T_map_node[2].vector());
}

/// Covariances along a path and of an inverse, against sampling.
TEST(PoseUncertainty, AgainstMonteCarlo) {
  Rng rng(4);
  PoseGraph2D graph;
  graph.T_map_node = {SE2(1, 2, 0.7)};
  const SE2 motions[] = {{1, 0.2, 0.5}, {2, -0.3, -1.0}, {0.5, 0.5, 2.0}};
  const Mat3 covariance = Vec3(4e-4, 1e-4, 9e-4).asDiagonal();  // in the axes of each motion's start
  for (std::size_t i = 0; i < 3; ++i) {
    graph.T_map_node.push_back(graph.T_map_node.back() * motions[i]);
    graph.edges.push_back(
        {i, i + 1, motions[i], edge_information(motions[i], covariance), PoseEdgeKind::kOdometry});
    EXPECT_LT((edge_covariance(graph.edges[i]) - covariance).norm(), 1e-12);
  }
  Mat3 forward = Mat3::Zero(), backward = Mat3::Zero();
  const SE2 whole = graph.T_map_node[0].inverse() * graph.T_map_node[3];
  constexpr int kSamples = 40000;
  for (int s = 0; s < kSamples; ++s) {
    SE2 T;
    for (const SE2& motion : motions)
      T = T * SE2(motion.x() + rng.normal(0, 0.02), motion.y() + rng.normal(0, 0.01),
                  motion.angle() + rng.normal(0, 0.03));
    Vec3 error = T.vector() - whole.vector(), back = T.inverse().vector() - whole.inverse().vector();
    error.z() = wrap_angle(error.z());
    back.z() = wrap_angle(back.z());
    forward += error * error.transpose() / kSamples;
    backward += back * back.transpose() / kSamples;
  }
  EXPECT_LT((test::all_seen_from<PlanarPaths>(graph, 0)[3].covariance - forward).norm(),
            0.05 * forward.norm());
  EXPECT_LT((test::all_seen_from<PlanarPaths>(graph, 3)[0].covariance - backward).norm(),
            0.05 * backward.norm());
  EXPECT_EQ(test::all_seen_from<PlanarPaths>(graph, 2)[2].covariance, Mat3::Zero());
  // A loop is a shorter path; a node without a path is not reached.
  graph.edges.push_back({0, 3, whole, edge_information(whole, 0.01 * covariance), PoseEdgeKind::kLoop});
  EXPECT_LT((test::all_seen_from<PlanarPaths>(graph, 0)[3].covariance - 0.01 * covariance).norm(), 1e-10);
  graph.T_map_node.emplace_back();
  EXPECT_FALSE(test::all_seen_from<PlanarPaths>(graph, 0)[4].reached);
}

}  // namespace
}  // namespace hm
