#include "hm/slam/pose_graph/path_uncertainty.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "hm/core/rng.hpp"
#include "hm/slam/pose_graph/pose_uncertainty.hpp"
#include "hm/slam/pose_graph/pose_uncertainty_3d.hpp"
#include "hm/slam/pose_graph/testing/whole_graph.hpp"

namespace hm {
namespace {

Mat6 random_information(Rng& rng) {
  const Vec6 sigmas = Vec6::NullaryExpr([&rng] { return rng.uniform(0.001, 0.02); });
  return sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
}

/// A chain with loops; every `break_every`-th node begins a new chain, which a loop connects.
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
    if (a != b) graph.edges.push_back({a, b, motion(1), random_information(rng), PoseEdgeKind::kLoop});
  }
  std::stable_sort(graph.edges.begin(), graph.edges.end(), [](const PoseEdge3D& a, const PoseEdge3D& b) {
    return std::max(a.from, a.to) < std::max(b.from, b.to);
  });
  return graph;
}

/// The same by searching the whole graph without any index (the slow reference).
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

/// Further away than the search goes, the chain of odometry edges is what is known, both ways.
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

TEST(PathUncertainty, IsAnUpperBoundWithLoopsBeyondTheSearch) {
  Rng rng(3);
  const PoseGraph3D graph = random_graph(150, 40, 1000, rng);
  const PathUncertainty3D bounded = test::paths_of<SpatialPaths>(graph, 10);
  for (int trial = 0; trial < 50; ++trial) {
    const std::size_t node = rng.below(150);
    const std::size_t targets[] = {rng.below(150)};
    const SeenUncertainty seen = bounded.seen_from(graph, node, targets)[0];
    ASSERT_TRUE(seen.reached);
    EXPECT_GE(SpatialPaths::size_of(seen.covariance),
              0.99 * SpatialPaths::size_of(by_whole_graph(graph, node)[targets[0]].covariance));
  }
}

TEST(PathUncertainty, ForgetsEdgesThatAreTakenOut) {
  Rng rng(4);
  PoseGraph3D graph = random_graph(60, 30, 1000, rng);
  PathUncertainty3D paths = test::paths_of<SpatialPaths>(graph);
  std::erase_if(graph.edges, [](const PoseEdge3D& edge) { return edge.kind == PoseEdgeKind::kLoop; });
  paths.replace_edges(graph.edges);
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

/// The plane's covariances are along the axes of the node that sees: the chain composes them as the search.
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
