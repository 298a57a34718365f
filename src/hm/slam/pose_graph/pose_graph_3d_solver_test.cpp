#include "hm/slam/pose_graph/pose_graph_3d_solver.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <numbers>

#include "hm/core/rng.hpp"
#include "hm/slam/pose_graph/pose_uncertainty_3d.hpp"
#include "hm/slam/pose_graph/testing/whole_graph.hpp"

namespace hm {
namespace {

Vec6 random_vector(Rng& rng, double size_m, double size_rad) {
  Vec6 v;
  for (int i = 0; i < 6; ++i) v[i] = rng.normal(0, i < 3 ? size_m : size_rad);
  return v;
}

TEST(PoseGraphSolver3D, JacobianAgainstDifferences) {
  Rng rng(1);
  for (int trial = 0; trial < 200; ++trial) {
    const SE3 from = SE3::exp(random_vector(rng, 5, 1)), to = SE3::exp(random_vector(rng, 5, 1));
    PoseEdge3D edge;
    // From no error to rotations of nearly 180 degrees.
    const double size = trial < 20 ? 1e-6 : 0.01 * trial;
    Vec6 error = random_vector(rng, size, 0.4 * size);
    if (error.tail<3>().norm() > 3) error.tail<3>() *= 3 / error.tail<3>().norm();
    edge.T_from_to = moved_by(from.inverse() * to, error);
    const auto jacobian = pose_edge_jacobian(edge, from, to);
    constexpr double kStep = 1e-6;
    for (int k = 0; k < 12; ++k) {
      const auto moved = [&](double step) {
        Vec6 move = Vec6::Zero();
        move[k % 6] = step;
        return k < 6 ? pose_edge_error(edge, moved_by(from, move), to)
                     : pose_edge_error(edge, from, moved_by(to, move));
      };
      EXPECT_LT(((moved(kStep) - moved(-kStep)) / (2 * kStep) - jacobian.col(k)).norm(), 2e-6) << trial;
    }
  }
}

/// Spiral path around a cylinder, with loops between successive turns.
PoseGraph3D spiral(double noise, std::vector<SE3>& truth) {
  Rng rng(2);
  PoseGraph3D graph;
  constexpr int kPerTurn = 12, kNodes = 60;
  for (int i = 0; i < kNodes; ++i) {
    const double angle = 2 * std::numbers::pi * i / kPerTurn;
    truth.emplace_back(Mat3(so3_exp(Vec3(0, 0, angle)) * so3_exp(Vec3(0.3 * std::sin(i), 0, 0))),
                       Vec3(3 * std::cos(angle), 3 * std::sin(angle), 0.1 * i));
  }
  const SE3 T_start = truth[0].inverse();
  for (SE3& T : truth) T = T_start * T;
  const auto add = [&](std::size_t a, std::size_t b, PoseEdgeKind kind) {
    Mat6 information = Mat6::Zero();
    information.diagonal() << 100, 120, 80, 400, 300, 500;
    graph.edges.push_back(
        {a, b, moved_by(truth[a].inverse() * truth[b], random_vector(rng, noise, noise)), information, kind});
  };
  for (std::size_t i = 0; i + 1 < kNodes; ++i) add(i, i + 1, PoseEdgeKind::kOdometry);
  for (std::size_t i = 0; i + kPerTurn < kNodes; i += 3) add(i, i + kPerTurn, PoseEdgeKind::kLoop);
  graph.T_map_node.push_back(truth[0]);
  for (std::size_t i = 0; i + 1 < kNodes; ++i)
    graph.T_map_node.push_back(
        moved_by(graph.T_map_node.back() * graph.edges[i].T_from_to, random_vector(rng, 0.02, 0.01)));
  return graph;
}

double distance(const SE3& a, const SE3& b) { return (a.inverse() * b).log().norm(); }

TEST(PoseGraphSolver3D, ExactEdgesGiveTheTruth) {
  std::vector<SE3> truth;
  PoseGraph3D graph = spiral(0, truth);
  const PoseGraphSolution solution = solve_pose_graph(graph);
  EXPECT_TRUE(solution.converged) << solution.message;
  EXPECT_GT(solution.initial_chi2, 1);
  EXPECT_LT(solution.final_chi2, 1e-8);
  for (std::size_t i = 0; i < truth.size(); ++i) EXPECT_LT(distance(truth[i], graph.T_map_node[i]), 1e-5);
}

TEST(PoseGraphSolver3D, OptimumIsAMinimumAndDeterministic) {
  std::vector<SE3> truth;
  PoseGraph3D graph = spiral(0.05, truth), again = graph;
  EXPECT_TRUE(solve_pose_graph(graph).converged);
  solve_pose_graph(again);
  for (std::size_t i = 0; i < truth.size(); ++i)
    EXPECT_EQ(graph.T_map_node[i].matrix(), again.T_map_node[i].matrix());
  EXPECT_EQ(graph.T_map_node[0].matrix(), truth[0].matrix());
  Rng rng(3);
  const double least = pose_graph_chi2(graph);
  for (int trial = 0; trial < 200; ++trial) {
    PoseGraph3D moved = graph;
    SE3& node = moved.T_map_node[1 + rng.below(59)];
    node = moved_by(node, random_vector(rng, 1e-3, 1e-3));
    EXPECT_GT(pose_graph_chi2(moved), least - 1e-6);
  }
}

/// The same optimum as dense Gauss-Newton with numeric derivatives, an independent implementation.
TEST(PoseGraphSolver3D, AgreesWithDenseNumericGaussNewton) {
  std::vector<SE3> truth;
  PoseGraph3D graph = spiral(0.08, truth), reference = graph;
  solve_pose_graph(graph);
  const auto unknowns = static_cast<Eigen::Index>(6 * (truth.size() - 1));
  for (int round = 0; round < 15; ++round) {
    Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(unknowns, unknowns);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(unknowns);
    for (const PoseEdge3D& edge : reference.edges) {
      const SE3 &a = reference.T_map_node[edge.from], &b = reference.T_map_node[edge.to];
      Eigen::Matrix<double, 6, 12> jacobian;
      for (int k = 0; k < 12; ++k) {
        Vec6 move = Vec6::Zero();
        move[k % 6] = 1e-6;
        jacobian.col(k) = k < 6 ? (pose_edge_error(edge, moved_by(a, move), b) -
                                   pose_edge_error(edge, moved_by(a, -move), b)) /
                                      2e-6
                                : (pose_edge_error(edge, a, moved_by(b, move)) -
                                   pose_edge_error(edge, a, moved_by(b, -move))) /
                                      2e-6;
      }
      const Vec6 error = pose_edge_error(edge, a, b);
      const std::size_t nodes[2] = {edge.from, edge.to};
      for (int s = 0; s < 2; ++s) {
        if (nodes[s] == 0) continue;
        const auto row = static_cast<Eigen::Index>(6 * (nodes[s] - 1));
        gradient.segment<6>(row) += jacobian.middleCols<6>(6 * s).transpose() * edge.information * error;
        for (int t = 0; t < 2; ++t)
          if (nodes[t] != 0)
            hessian.block<6, 6>(row, static_cast<Eigen::Index>(6 * (nodes[t] - 1))) +=
                jacobian.middleCols<6>(6 * s).transpose() * edge.information * jacobian.middleCols<6>(6 * t);
      }
    }
    const Eigen::VectorXd step = hessian.llt().solve(-gradient);
    for (std::size_t i = 1; i < truth.size(); ++i)
      reference.T_map_node[i] =
          moved_by(reference.T_map_node[i], step.segment<6>(static_cast<Eigen::Index>(6 * (i - 1))));
  }
  EXPECT_NEAR(pose_graph_chi2(graph), pose_graph_chi2(reference), 1e-5 * pose_graph_chi2(reference));
  for (std::size_t i = 0; i < truth.size(); ++i)
    EXPECT_LT(distance(graph.T_map_node[i], reference.T_map_node[i]), 2e-3);
}

/// One loop in 17 is false: the robust loss limits its influence; then it is detected and removed.
TEST(PoseGraphSolver3D, FalseLoopIsTakenOut) {
  const auto worst_error = [](const PoseGraph3D& graph, const std::vector<SE3>& truth) {
    double worst = 0;
    for (std::size_t i = 0; i < truth.size(); ++i)
      worst = std::max(worst, (truth[i].inverse() * graph.T_map_node[i]).translation().norm());
    return worst;
  };
  std::vector<SE3> truth;
  PoseGraph3D graph = spiral(0, truth);
  Mat6 information = Mat6::Identity() * 400;
  const SE3 lie = truth[7].inverse() * truth[40] * SE3(Mat3::Identity(), Vec3(1.5, 0, 0.4));
  graph.edges.insert(graph.edges.begin() + 60, {7, 40, lie, information, PoseEdgeKind::kLoop});
  PoseGraph3D plain = graph, robust = graph;
  solve_pose_graph(plain, {200, 0});
  EXPECT_GT(worst_error(plain, truth), 0.3);
  solve_pose_graph(robust, {200, 1});
  EXPECT_LT(worst_error(robust, truth), 0.1);
  const ContradictionResult result = solve_without_contradictions(graph, 40, {200, 9});
  EXPECT_EQ(result.removed, std::vector<std::size_t>{60});
  EXPECT_EQ(graph.edges.size(), plain.edges.size() - 1);
  EXPECT_LT(worst_error(graph, truth), 1e-4);
}

TEST(PoseGraphSolver3D, DegenerateGraphs) {
  PoseGraph3D graph;
  EXPECT_TRUE(solve_pose_graph(graph).converged);
  const SE3 first = SE3::exp((Vec6() << 1, 2, 3, 0.1, 0.2, 0.3).finished());
  graph.T_map_node = {first, first * first, first * first * first};
  EXPECT_TRUE(solve_pose_graph(graph).converged);
  graph.edges.push_back({1, 2, SE3(), Mat6::Identity(), PoseEdgeKind::kOdometry});  // disconnected
  EXPECT_LT(solve_pose_graph(graph).final_chi2, 1e-6);
  EXPECT_EQ(graph.T_map_node[0].matrix(), first.matrix());
  graph.edges[0].information.setZero();
  solve_pose_graph(graph);
  EXPECT_TRUE(graph.T_map_node[2].translation().allFinite());
  graph.edges[0].information(0, 0) = std::numeric_limits<double>::quiet_NaN();
  const PoseGraph3D before = graph;
  EXPECT_FALSE(solve_pose_graph(graph).converged);
  EXPECT_EQ(graph.T_map_node[2].matrix(), before.T_map_node[2].matrix());
}

TEST(PoseUncertainty3D, AddsUpAlongTheShortestWay) {
  PoseGraph3D graph;
  graph.T_map_node = {SE3()};
  const Mat6 covariance = (Vec6() << 1e-4, 2e-4, 1e-4, 1e-4, 3e-4, 1e-4).finished().asDiagonal();
  const SE3 step(so3_exp(Vec3(0, 0.3, 0)), Vec3(0.1, 0, 1));
  for (std::size_t i = 0; i < 5; ++i) {
    graph.T_map_node.push_back(graph.T_map_node.back() * step);
    graph.edges.push_back({i, i + 1, step, covariance.inverse(), PoseEdgeKind::kOdometry});
  }
  Mat6 expected = Mat6::Zero();
  for (std::size_t i = 0; i <= 5; ++i) {
    const auto seen = test::all_seen_from<SpatialPaths>(graph, 0)[i];
    EXPECT_LT((seen.covariance - expected).norm(), 1e-9);
    EXPECT_NEAR(seen.path_m, static_cast<double>(i) * step.translation().norm(), 1e-9);
    EXPECT_TRUE(seen.reached);
    expected = compose_covariance(expected, step, covariance);
  }
  // From the other end: the covariance of the inverse, as composed directly from inverse steps.
  const Mat6 back = test::all_seen_from<SpatialPaths>(graph, 5)[0].covariance;
  Mat6 inverse = Mat6::Zero();
  for (int i = 0; i < 5; ++i)
    inverse = compose_covariance(inverse, step.inverse(), inverse_covariance(step, covariance));
  EXPECT_LT((back - inverse).norm(), 1e-9);
  // An accurate loop is a shorter path; a node without a path is not reached.
  const SE3 whole = graph.T_map_node[5];
  graph.edges.push_back({0, 5, whole, Mat6(1e6 * Mat6::Identity()), PoseEdgeKind::kLoop});
  graph.T_map_node.emplace_back();
  const auto seen = test::all_seen_from<SpatialPaths>(graph, 0);
  EXPECT_LT((seen[5].covariance - 1e-6 * Mat6::Identity()).norm(), 1e-12);
  EXPECT_EQ(seen[5].path_m, 0);
  EXPECT_FALSE(seen[6].reached);
}

}  // namespace
}  // namespace hm
