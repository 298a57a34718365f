#include "hm/slam/pose_graph/pose_graph_2d_solver.hpp"

#include <ceres/ceres.h>

#include <algorithm>

#include "hm/core/check.hpp"
#include "hm/slam/pose_graph/graph_problem.hpp"

namespace hm {
namespace {

/// root * pose_edge_error, with its derivatives.
class PlanarEdgeCost : public ceres::SizedCostFunction<3, 3, 3> {
 public:
  explicit PlanarEdgeCost(const PoseEdge2D& edge)
      : edge_(edge), root_(detail::information_root(edge.information)) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const SE2 T_map_from(parameters[0][0], parameters[0][1], parameters[0][2]);
    const SE2 T_map_to(parameters[1][0], parameters[1][1], parameters[1][2]);
    Eigen::Map<Vec3>(residuals, 3) = root_ * pose_edge_error(edge_, T_map_from, T_map_to);
    if (jacobians == nullptr) return true;
    const Eigen::Matrix<double, 3, 6> jacobian = root_ * pose_edge_jacobian(edge_, T_map_from, T_map_to);
    using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    for (int side = 0; side < 2; ++side)
      if (jacobians[side] != nullptr)
        Eigen::Map<RowMajor>(jacobians[side], 3, 3) = jacobian.middleCols<3>(3 * side);
    return true;
  }

 private:
  PoseEdge2D edge_;
  Mat3 root_;
};

bool all_finite(const PoseGraph2D& graph) {
  for (const SE2& node : graph.T_map_node)
    if (!node.vector().allFinite()) return false;
  for (const PoseEdge2D& edge : graph.edges)
    if (!edge.T_from_to.vector().allFinite() || !edge.information.allFinite()) return false;
  return true;
}

void add_edges(const PoseGraph2D& graph, const PoseGraphSolverParams& params, std::vector<Vec3>& states,
               ceres::Problem& problem) {
  for (const PoseEdge2D& edge : graph.edges) {
    HM_CHECK(edge.from < states.size() && edge.to < states.size() && edge.from != edge.to,
             "edge from {} to {} of {} nodes", edge.from, edge.to, states.size());
    problem.AddResidualBlock(new PlanarEdgeCost(edge), detail::new_edge_loss(edge.kind, params),
                             states[edge.from].data(), states[edge.to].data());
  }
}

}  // namespace

Eigen::Matrix<double, 3, 6> pose_edge_jacobian(const PoseEdge2D& edge, const SE2& T_map_from,
                                               const SE2& T_map_to) {
  const Mat2 to_error = edge.T_from_to.rotation().transpose() * T_map_from.rotation().transpose();
  const Vec2 between = to_error * (T_map_to.translation() - T_map_from.translation());
  Eigen::Matrix<double, 3, 6> jacobian = Eigen::Matrix<double, 3, 6>::Zero();
  jacobian.block<2, 2>(0, 0) = -to_error;
  jacobian.block<2, 2>(0, 3) = to_error;
  jacobian.block<2, 1>(0, 2) = Vec2(between.y(), -between.x());
  jacobian(2, 2) = -1;
  jacobian(2, 5) = 1;
  return jacobian;
}

PoseGraphSolution solve_pose_graph(PoseGraph2D& graph, const PoseGraphSolverParams& params,
                                   std::size_t held) {
  PoseGraphSolution solution;
  if (!detail::begin_solution(graph, all_finite(graph), solution)) return solution;
  std::vector<Vec3> states;
  for (const SE2& node : graph.T_map_node) states.push_back(node.vector());
  ceres::Problem problem;
  add_edges(graph, params, states, problem);
  for (std::size_t i = 0; i < std::min(held, states.size()); ++i)
    if (problem.HasParameterBlock(states[i].data())) problem.SetParameterBlockConstant(states[i].data());
  if (!detail::solve_graph_problem(problem, params, solution)) return solution;
  for (std::size_t i = 0; i < states.size(); ++i)
    graph.T_map_node[i] = SE2(states[i].x(), states[i].y(), states[i].z());
  solution.final_chi2 = pose_graph_chi2(graph);
  return solution;
}

}  // namespace hm
