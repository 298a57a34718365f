#include <gtest/gtest.h>

#include <Eigen/LU>

#include "hm/io/g2o_file.hpp"
#include "hm/io/real_data_test_support.hpp"
#include "hm/slam/pose_graph_solver.hpp"

/// Public pose graphs: the solver's optimum against the certified global optima of Rosen et al., "SE-Sync",
/// IJRR 2019.
namespace hm {
namespace {

std::filesystem::path data(const std::string& name) { return real_data_folder() / name; }

/// SE-Sync's isotropic weights of an edge: of the translation, and of the chordal distance of rotations.
Vec2 isotropic_weights(const PoseEdge2D& edge) {
  const Mat2 translation = edge.information.topLeftCorner<2, 2>();
  return {2 / translation.inverse().trace(), edge.information(2, 2)};
}

/// The cost that SE-Sync minimises: kappa |R_j - R_i R_ij|^2 + tau |t_j - t_i - R_i t_ij|^2.
double chordal_cost(const PoseGraph2D& graph, const std::vector<Vec2>& weights) {
  double sum = 0;
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    const SE2 &from = graph.T_map_node[graph.edges[e].from], &to = graph.T_map_node[graph.edges[e].to];
    const SE2 predicted = from * graph.edges[e].T_from_to;
    sum += weights[e].x() * (to.translation() - predicted.translation()).squaredNorm() +
           weights[e].y() * (to.rotation() - predicted.rotation()).squaredNorm();
  }
  return sum;
}

/// The cost at the optimum of our own error with the same weights, which is the same to second order.
void expect_cost(const std::string& name, double published, double tolerance) {
  const auto path = data("posegraph/" + name);
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no pose graph at " << path;
  auto read = read_g2o_2d(path);
  ASSERT_TRUE(read) << to_string(read.error());
  PoseGraph2D& graph = read->graph;
  std::vector<Vec2> weights;
  for (PoseEdge2D& edge : graph.edges) {
    weights.push_back(isotropic_weights(edge));
    edge.information = Vec3(weights.back().x(), weights.back().x(), 2 * weights.back().y()).asDiagonal();
  }
  const PoseGraphSolution solution = solve_pose_graph(graph);
  EXPECT_TRUE(solution.converged) << solution.message;
  const double cost = chordal_cost(graph, weights);
  ::testing::Test::RecordProperty("cost", std::to_string(cost));
  EXPECT_GE(cost, published * (1 - 1e-3));  // nothing is below the global optimum
  EXPECT_LE(cost, published * (1 + tolerance)) << solution.iterations << " iterations";
}

TEST(PoseGraphCost, Intel) { expect_cost("intel.g2o", 52.35, 0.01); }
TEST(PoseGraphCost, Manhattan) { expect_cost("manhattan.g2o", 6432, 0.01); }

}  // namespace
}  // namespace hm
