#include "hm/slam/pose_graph/path_uncertainty.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <array>
#include <limits>

#include "hm/core/rng.hpp"
#include "hm/geometry/solvers/small_solvers.hpp"
#include "hm/slam/pose_graph/pose_graph_3d_solver.hpp"
#include "hm/slam/pose_graph/pose_uncertainty.hpp"
#include "hm/slam/pose_graph/pose_uncertainty_3d.hpp"
#include "hm/slam/pose_graph/testing/whole_graph.hpp"

namespace hm {
namespace {

Mat6 random_information(Rng& rng) {
  const Vec6 sigmas = Vec6::NullaryExpr([&rng] { return rng.uniform(0.001, 0.02); });
  return sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
}

/// Chain with loops; every `break_every`-th node begins a new chain, connected by a loop.
PoseGraph3D random_graph(std::size_t nodes, std::size_t loops, std::size_t break_every, Rng& rng) {
  PoseGraph3D graph;
  const auto motion = [&rng](double scale) {
    return SE3::exp(scale * Vec6::NullaryExpr([&rng] { return rng.normal(); }));
  };
  for (std::size_t i = 0; i < nodes; ++i) {
    const SE3 step = motion(0.3);
    graph.T_map_node.push_back(i == 0 ? SE3() : graph.T_map_node.back() * step);
    if (i == 0) continue;
    const bool is_broken = i % break_every == 0;
    graph.edges.push_back(
        {i - 1, i, step, random_information(rng), is_broken ? PoseEdgeKind::kLoop : PoseEdgeKind::kOdometry});
  }
  for (std::size_t l = 0; l < loops; ++l) {
    const auto a = rng.below(static_cast<std::uint32_t>(nodes)),
               b = rng.below(static_cast<std::uint32_t>(nodes));
    if (a == b) continue;
    const SE3 T_a_b = graph.T_map_node[a].inverse() * graph.T_map_node[b];
    graph.edges.push_back({a, b, T_a_b, random_information(rng), PoseEdgeKind::kLoop});
  }
  std::stable_sort(graph.edges.begin(), graph.edges.end(), [](const PoseEdge3D& a, const PoseEdge3D& b) {
    return std::max(a.from, a.to) < std::max(b.from, b.to);
  });
  return graph;
}

/// The same by a search of the whole graph without an index (slow reference).
std::vector<SeenUncertainty> by_whole_graph(const PoseGraph3D& graph, std::size_t node) {
  const std::size_t count = graph.T_map_node.size();
  std::vector<SeenUncertainty> seen(count);
  std::vector<double> sizes(count, std::numeric_limits<double>::infinity());
  std::vector<bool> done(count, false);
  seen[node].reached = true;
  sizes[node] = 0;
  for (std::size_t round = 0; round < count; ++round) {
    std::size_t at = count;
    for (std::size_t i = 0; i < count; ++i)
      if (!done[i] && seen[i].reached && (at == count || sizes[i] < sizes[at])) at = i;
    if (at == count) break;
    done[at] = true;
    for (const PoseEdge3D& edge : graph.edges) {
      if (edge.from != at && edge.to != at) continue;
      const bool forward = edge.from == at;
      const std::size_t next = forward ? edge.to : edge.from;
      const Mat6 along = SpatialPaths::edge_covariance(edge);
      const Mat6 covariance = forward ? compose_covariance(seen[at].covariance, edge.T_from_to, along)
                                      : compose_covariance(seen[at].covariance, edge.T_from_to.inverse(),
                                                           inverse_covariance(edge.T_from_to, along));
      if (done[next] || !(SpatialPaths::size_of(covariance) < sizes[next])) continue;
      sizes[next] = SpatialPaths::size_of(covariance);
      seen[next] = {covariance, seen[at].path_m + SpatialPaths::path_m(edge), true};
    }
  }
  return seen;
}

TEST(PathUncertainty, IsThatOfASearchThroughTheWholeGraph) {
  Rng rng(1);
  for (int trial = 0; trial < 20; ++trial) {
    const PoseGraph3D graph = random_graph(60, static_cast<std::size_t>(trial), 17, rng);
    const PathUncertainty3D paths = test::paths_of<SpatialPaths>(graph);
    const std::size_t node = rng.below(60);
    const std::vector<std::size_t> targets{rng.below(60), node, rng.below(60)};
    const std::vector<SeenUncertainty> expected = by_whole_graph(graph, node);
    const std::vector<SeenUncertainty> seen = paths.seen_from(graph, node, targets);
    ASSERT_EQ(seen.size(), targets.size());
    for (std::size_t i = 0; i < targets.size(); ++i) {
      EXPECT_EQ(seen[i].covariance, expected[targets[i]].covariance);
      EXPECT_EQ(seen[i].path_m, expected[targets[i]].path_m);
      EXPECT_TRUE(seen[i].reached);
    }
  }
}

/// Beyond the reach of the search, the chain of odometry edges is used, in both directions.
TEST(PathUncertainty, IsThatOfTheChainBeyondTheSearch) {
  Rng rng(2);
  const PoseGraph3D graph = random_graph(150, 0, 1000, rng);
  const PathUncertainty3D bounded = test::paths_of<SpatialPaths>(graph, 10);
  for (int trial = 0; trial < 50; ++trial) {
    const std::size_t node = rng.below(150);
    const std::size_t targets[] = {rng.below(150)};
    const SeenUncertainty expected = by_whole_graph(graph, node)[targets[0]];
    const SeenUncertainty seen = bounded.seen_from(graph, node, targets)[0];
    ASSERT_TRUE(seen.reached);
    EXPECT_LE((seen.covariance - expected.covariance).norm(), 1e-9 * expected.covariance.norm());
    EXPECT_NEAR(seen.path_m, expected.path_m, 1e-9);
  }
}

/// Covariance of every node with `node` fixed, from all edges together (the inverse of the normal equations'
/// matrix): a lower bound for every path.
Eigen::MatrixXd marginals_seen_from(const PoseGraph3D& graph, std::size_t node) {
  const auto size = static_cast<Eigen::Index>(6 * graph.T_map_node.size());
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
  for (const PoseEdge3D& edge : graph.edges) {
    const auto jacobian = pose_edge_jacobian(edge, graph.T_map_node[edge.from], graph.T_map_node[edge.to]);
    const std::size_t ends[] = {edge.from, edge.to};
    for (int a = 0; a < 2; ++a)
      for (int b = 0; b < 2; ++b)
        information.block<6, 6>(static_cast<Eigen::Index>(6 * ends[a]),
                                static_cast<Eigen::Index>(6 * ends[b])) +=
            jacobian.middleCols<6>(6 * a).transpose() * edge.information * jacobian.middleCols<6>(6 * b);
  }
  const auto held = static_cast<Eigen::Index>(6 * node);
  information.block<6, 6>(held, held) += 1e15 * Mat6::Identity();
  return information.ldlt().solve(Eigen::MatrixXd::Identity(size, size));
}

TEST(PathUncertainty, IsAnUpperBoundWithLoopsBeyondTheSearch) {
  Rng rng(3);
  const PoseGraph3D graph = random_graph(100, 30, 1000, rng);
  const PathUncertainty3D bounded = test::paths_of<SpatialPaths>(graph, 10);
  for (int trial = 0; trial < 5; ++trial) {
    const std::size_t node = rng.below(100);
    const Eigen::MatrixXd least = marginals_seen_from(graph, node);
    for (std::size_t target = 0; target < 100; target += 7) {
      const SeenUncertainty seen = bounded.seen_from(graph, node, std::array{target})[0];
      ASSERT_TRUE(seen.reached);
      const auto at = static_cast<Eigen::Index>(6 * target);
      const Mat6 beyond = seen.covariance - Mat6(least.block<6, 6>(at, at));
      EXPECT_GE(symmetric_eigen(beyond).values.minCoeff(), -1e-6 * seen.covariance.trace() - 1e-12)
          << node << " to " << target;
    }
  }
}

/// Laps of a ring where every tenth node has loops to other laps: a short search does not reach a target at a
/// place visited many times; two searches that meet give the exact result.
TEST(PathUncertainty, FindsWhatALongSearchFindsWherePlacesAreVisitedAgainAndAgain) {
  constexpr std::size_t kLap = 50, kLaps = 60;
  Rng rng(7);
  PoseGraph3D graph;
  const Mat6 information = 1e6 * Mat6::Identity();
  for (std::size_t i = 0; i < kLap * kLaps; ++i) {
    const SE3 step = SE3::exp(0.2 * Vec6::NullaryExpr([&rng] { return rng.normal(); }));
    graph.T_map_node.push_back(i < kLap ? (i == 0 ? SE3() : graph.T_map_node.back() * step)
                                        : graph.T_map_node[i - kLap]);
    const auto motion_from = [&](std::size_t other) {
      return graph.T_map_node[other].inverse() * graph.T_map_node[i];
    };
    if (i > 0) graph.edges.push_back({i - 1, i, motion_from(i - 1), information, PoseEdgeKind::kOdometry});
    if (i < kLap || i % 10 != 0) continue;
    const std::size_t other = i - kLap * (1 + rng.below(static_cast<std::uint32_t>(i / kLap)));
    graph.edges.push_back({other, i, motion_from(other), information, PoseEdgeKind::kLoop});
  }
  const auto exact = test::paths_of<SpatialPaths>(graph, kLap * kLaps),
             bounded = test::paths_of<SpatialPaths>(graph, 128);
  for (int trial = 0; trial < 50; ++trial) {
    const std::size_t node = kLap * kLaps - 1 - rng.below(10);
    const std::size_t targets[] = {node % kLap + kLap * rng.below(kLaps - 1)};
    const double least = SpatialPaths::size_of(exact.seen_from(graph, node, targets)[0].covariance);
    const double seen = SpatialPaths::size_of(bounded.seen_from(graph, node, targets)[0].covariance);
    EXPECT_LT(seen, 1.1 * least);
  }
}

TEST(PathUncertainty, ForgetsEdgesThatAreTakenOut) {
  Rng rng(4);
  PoseGraph3D graph = random_graph(60, 30, 1000, rng);
  PathUncertainty3D paths = test::paths_of<SpatialPaths>(graph);
  for (const PoseEdge3D& edge : graph.edges)
    if (edge.kind == PoseEdgeKind::kLoop) paths.remove_loop(edge);
  std::erase_if(graph.edges, [](const PoseEdge3D& edge) { return edge.kind == PoseEdgeKind::kLoop; });
  const std::size_t targets[] = {40};
  EXPECT_EQ(paths.seen_from(graph, 3, targets)[0].covariance, by_whole_graph(graph, 3)[40].covariance);
}

TEST(PathUncertainty, AChainDoesNotGoOnWhereOdometryBroke) {
  Rng rng(5);
  const PoseGraph3D graph = random_graph(100, 0, 50, rng);
  const PathUncertainty3D bounded = test::paths_of<SpatialPaths>(graph, 5);
  const std::size_t targets[] = {49, 50};
  const std::vector<SeenUncertainty> seen = bounded.seen_from(graph, 0, targets);
  EXPECT_TRUE(seen[0].reached);
  EXPECT_FALSE(seen[1].reached);
}

/// Planar covariances are along the axes of the observing node: the chain composes them like the search.
TEST(PathUncertainty, OfThePlane) {
  Rng rng(6);
  PoseGraph2D graph;
  graph.T_map_node = {SE2(1, 2, 0.7)};
  const Mat3 covariance = Vec3(4e-4, 1e-4, 9e-4).asDiagonal();
  for (std::size_t i = 0; i < 70; ++i) {
    const SE2 motion(rng.normal(), rng.normal(), rng.normal());
    graph.T_map_node.push_back(graph.T_map_node.back() * motion);
    graph.edges.push_back({i, i + 1, motion, edge_information(motion, covariance), PoseEdgeKind::kOdometry});
  }
  const auto exact = test::paths_of<PlanarPaths>(graph), bounded = test::paths_of<PlanarPaths>(graph, 3);
  for (const std::size_t node : {5U, 69U}) {
    const std::size_t targets[] = {33};
    const Mat3 expected = exact.seen_from(graph, node, targets)[0].covariance;
    EXPECT_LT((bounded.seen_from(graph, node, targets)[0].covariance - expected).norm(),
              1e-9 * expected.norm());
  }
}

}  // namespace
}  // namespace hm
