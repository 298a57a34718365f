#include "hm/slam/pose_graph/graph_part.hpp"

#include <gtest/gtest.h>

#include "hm/core/rng.hpp"
#include "hm/slam/pose_graph/pose_graph_2d_solver.hpp"

namespace hm {
namespace {

/// Path along a line and back with odometry errors; loops where it passes the same position.
PoseGraph2D walk_there_and_back(std::size_t nodes, Rng& rng) {
  PoseGraph2D graph;
  const auto place = [&](std::size_t i) {
    const auto way = static_cast<double>(i % 100 < 50 ? i % 100 : 99 - i % 100);
    return SE2(0.5 * way, 0, 0);
  };
  const Mat3 information = 1e4 * Mat3::Identity();
  for (std::size_t i = 0; i < nodes; ++i) {
    const SE2 error(0.01 * rng.normal(), 0.01 * rng.normal(), 0.002 * rng.normal());
    if (i == 0) {
      graph.T_map_node.push_back(place(0));
      continue;
    }
    const SE2 motion = place(i - 1).inverse() * place(i) * error;
    graph.T_map_node.push_back(graph.T_map_node.back() * motion);
    graph.edges.push_back({i - 1, i, motion, information, PoseEdgeKind::kOdometry});
    if (i >= 100 && i % 5 == 0)
      graph.edges.push_back(
          {i - 100, i, place(i - 100).inverse() * place(i), information, PoseEdgeKind::kLoop});
  }
  return graph;
}

double largest_difference_m(const PoseGraph2D& a, const PoseGraph2D& b, std::size_t first) {
  double largest = 0;
  for (std::size_t i = first; i < a.T_map_node.size(); ++i)
    largest = std::max(largest, (a.T_map_node[i].translation() - b.T_map_node[i].translation()).norm());
  return largest;
}

TEST(GraphPart, OfAllNodesIsTheWholeGraph) {
  Rng rng(1);
  PoseGraph2D graph = walk_there_and_back(250, rng);
  const GraphPart<PoseGraph2D> part = part_since(graph, 0);
  EXPECT_EQ(part.held, 1);
  ASSERT_EQ(part.edges.size(), graph.edges.size());
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    EXPECT_EQ(part.graph.edges[e].from, graph.edges[e].from);
    EXPECT_EQ(part.graph.edges[e].to, graph.edges[e].to);
  }
}

/// The edges of a part equal those found by checking all edges.
TEST(GraphPart, HasEveryEdgeThatReachesItsNodes) {
  Rng rng(2);
  const PoseGraph2D graph = walk_there_and_back(300, rng);
  for (const std::size_t first : {1U, 57U, 150U, 299U}) {
    const GraphPart<PoseGraph2D> part = part_since(graph, first);
    std::vector<std::size_t> expected;
    for (std::size_t e = 0; e < graph.edges.size(); ++e)
      if (std::max(graph.edges[e].from, graph.edges[e].to) >= first) expected.push_back(e);
    EXPECT_EQ(part.edges, expected);
    for (std::size_t e = 0; e < part.edges.size(); ++e) {
      EXPECT_EQ(part.nodes[part.graph.edges[e].from], graph.edges[part.edges[e]].from);
      EXPECT_EQ(part.nodes[part.graph.edges[e].to], graph.edges[part.edges[e]].to);
    }
    for (std::size_t i = 0; i < part.held; ++i) EXPECT_LT(part.nodes[i], first);
    EXPECT_EQ(part.nodes.size() - part.held, graph.T_map_node.size() - first);
  }
}

/// After optimising a part, older nodes are bit-identical and newer ones are close to the full solution
/// (which also moves the older ones).
TEST(GraphPart, MovesTheNewestNodesToWhereTheWholeSolutionHasThem) {
  Rng rng(3);
  PoseGraph2D whole = walk_there_and_back(400, rng), graph = whole;
  PoseGraph2D older = graph;
  older.T_map_node.resize(300);
  std::erase_if(older.edges, [](const PoseEdge2D& edge) { return edge.to >= 300; });
  ASSERT_TRUE(solve_pose_graph(older).converged);
  std::copy(older.T_map_node.begin(), older.T_map_node.end(), graph.T_map_node.begin());
  const PoseGraph2D before = graph;
  ASSERT_TRUE(solve_pose_graph(whole).converged);
  const double before_m = largest_difference_m(before, whole, 300);
  ASSERT_GT(before_m, 0.1);

  GraphPart<PoseGraph2D> part = part_since(graph, 300);
  ASSERT_TRUE(solve_pose_graph(part.graph, {}, part.held).converged);
  put_back(part, graph);
  for (std::size_t i = 0; i < 300; ++i)
    EXPECT_EQ(graph.T_map_node[i].vector(), before.T_map_node[i].vector());
  EXPECT_LT(largest_difference_m(graph, whole, 300), 0.2 * before_m);
}

/// One loop per keyframe: the total number of optimised nodes per keyframe does not grow with the graph.
TEST(SolutionWindow, MovesAsManyNodesAKeyframeHoweverLargeTheGraphIs) {
  const auto moved_a_keyframe = [](std::size_t nodes) {
    SolutionWindow window;
    double moved = 0;
    for (std::size_t n = 1; n <= nodes; ++n)
      if (n % 4 == 0) moved += static_cast<double>(n - window.next(n, false));
    return moved / static_cast<double>(nodes);
  };
  EXPECT_EQ(SolutionWindow().next(SolutionWindow::kNewest, false), 0);
  EXPECT_LT(moved_a_keyframe(100000), 1.2 * moved_a_keyframe(10000));
  SolutionWindow window;
  EXPECT_EQ(window.next(5000, false), 0);
  EXPECT_EQ(window.next(5001, false), 5001 - SolutionWindow::kNewest);
  EXPECT_EQ(window.next(5002, true), 0);
}

}  // namespace
}  // namespace hm
