#include <gtest/gtest.h>

#include <Eigen/LU>
#include <string>

#include "chordal_certificate.hpp"
#include "hm/io/pose/g2o_file.hpp"
#include "hm/io/testing/real_data_test_support.hpp"
#include "hm/slam/pose_graph/pose_graph_2d_solver.hpp"
#include "hm/slam/pose_graph/pose_graph_3d_solver.hpp"

/// Public pose graphs: the solvers' optima against the global optimum of SE-Sync's cost (Rosen et al., IJRR
/// 2019), which a dual certificate proves to be one here, to the digits given.
namespace hm {
namespace {

using test::ChordalGraph;

std::filesystem::path data(const std::string& name) { return real_data_folder() / "posegraph" / name; }

/// SE-Sync's isotropic weights. In the plane kappa is the information of the angle itself; in space half of
/// the mean one (harmonic), so that kappa |R - R'|_F^2 is angle^2 times information there, twice that in the
/// plane.
Vec2 isotropic_weights(const PoseEdge2D& edge) {
  const Mat2 translation = edge.information.topLeftCorner<2, 2>();
  return {2 / translation.inverse().trace(), edge.information(2, 2)};
}
Vec2 isotropic_weights(const PoseEdge3D& edge) {
  const Mat3 translation = edge.information.topLeftCorner<3, 3>(),
             turn = edge.information.bottomRightCorner<3, 3>();
  return {3 / translation.inverse().trace(), 3 / (2 * turn.inverse().trace())};
}

template <int kDim, class Graph>
ChordalGraph<kDim> chordal(const Graph& graph, const std::vector<Vec2>& weights) {
  ChordalGraph<kDim> result;
  for (const auto& T : graph.T_map_node) result.nodes.push_back({T.rotation(), T.translation()});
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    const auto& edge = graph.edges[e];
    result.edges.push_back({edge.from,
                            edge.to,
                            {edge.T_from_to.rotation(), edge.T_from_to.translation()},
                            weights[e].y(),
                            weights[e].x()});
  }
  return result;
}

/// The graph with our own error weighted as that cost is, to second order.
void weigh(PoseEdge2D& edge, const Vec2& weights) {
  edge.information = Vec3(weights.x(), weights.x(), 2 * weights.y()).asDiagonal();
}
void weigh(PoseEdge3D& edge, const Vec2& weights) {
  edge.information =
      (Vec6() << Vec3::Constant(weights.x()), Vec3::Constant(2 * weights.y())).finished().asDiagonal();
}

/// The optimum of our own error must lie within `tolerance` of the certified global optimum of the chordal
/// cost, which must be `expected` to four digits.
template <int kDim, class G2o>
void expect_optimum(Result<G2o> read, double expected, double tolerance) {
  ASSERT_TRUE(read) << to_string(read.error());
  std::vector<Vec2> weights;
  for (auto& edge : read->graph.edges) {
    weights.push_back(isotropic_weights(edge));
    weigh(edge, weights.back());
  }
  const PoseGraphSolution solution = solve_pose_graph(read->graph);
  EXPECT_TRUE(solution.converged) << solution.message;
  ChordalGraph<kDim> graph = chordal<kDim>(read->graph, weights);
  const double ours = graph.cost();
  graph.polish(4);
  const double optimum = graph.cost();
  // One part in 20000 of the cost is what may be missing to the global optimum.
  const double epsilon = 5e-5 * optimum / (kDim * static_cast<double>(graph.nodes.size()));
  const auto bound = graph.lower_bound(epsilon);
  ASSERT_TRUE(bound) << "no certificate at cost " << optimum;
  EXPECT_NEAR(optimum, expected, 1e-4 * expected);
  EXPECT_GE(ours, *bound);
  EXPECT_LE(ours, optimum * (1 + tolerance)) << solution.iterations << " iterations";
}

#define HM_NEEDS(path) \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no pose graph at " << (path)

TEST(PoseGraphCost, Intel) {
  HM_NEEDS(data("intel.g2o"));
  expect_optimum<2>(read_g2o_2d(data("intel.g2o")), 52.35, 0.01);
}
TEST(PoseGraphCost, Manhattan) {
  HM_NEEDS(data("manhattan.g2o"));
  expect_optimum<2>(read_g2o_2d(data("manhattan.g2o")), 6431.4, 0.01);
}
TEST(PoseGraphCost, TinyGrid3D) {
  HM_NEEDS(data("tinyGrid3D.g2o"));
  expect_optimum<3>(read_g2o_3d(data("tinyGrid3D.g2o")), 18.519, 0.01);
}
TEST(PoseGraphCost, SmallGrid3D) {
  HM_NEEDS(data("smallGrid3D.g2o"));
  expect_optimum<3>(read_g2o_3d(data("smallGrid3D.g2o")), 1025.4, 0.01);
}
TEST(PoseGraphCost, Sphere2500) {
  HM_NEEDS(data("sphere2500.g2o"));
  expect_optimum<3>(read_g2o_3d(data("sphere2500.g2o")), 1687, 0.01);
}

}  // namespace
}  // namespace hm
