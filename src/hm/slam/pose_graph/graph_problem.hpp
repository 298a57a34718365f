#pragma once
#include <Eigen/Core>

#include "hm/geometry/pose_edge_kind.hpp"
#include "hm/geometry/solvers/small_solvers.hpp"
#include "hm/slam/pose_graph/pose_graph_2d_solver.hpp"

namespace ceres {
class LossFunction;
class Problem;
}  // namespace ceres

namespace hm::detail {

/// The square root R of an information matrix (R^T R), also of one that is not of full rank.
template <int kSize>
Eigen::Matrix<double, kSize, kSize> information_root(const Eigen::Matrix<double, kSize, kSize>& information) {
  const auto solved = symmetric_eigen(information);
  return solved.values.cwiseMax(0).cwiseSqrt().asDiagonal() * solved.vectors.transpose();
}

/// The loss of an edge: Cauchy's for loops where the parameters ask for it, else none. The caller owns it.
ceres::LossFunction* new_edge_loss(PoseEdgeKind kind, const PoseGraphSolverParams& params);

/// Fills in the solution before optimisation. Returns false when there is nothing to solve: the graph is not
/// finite, or has no edges.
template <class Graph>
bool begin_solution(const Graph& graph, bool is_finite, PoseGraphSolution& solution) {
  if (!is_finite) {
    solution.message = "the graph is not finite";
    return false;
  }
  solution.initial_chi2 = solution.final_chi2 = pose_graph_chi2(graph);
  solution.converged = true;
  return !graph.edges.empty();
}

/// Solves a pose graph's problem (sparse Cholesky, one thread). Fills message, iterations and converged;
/// false when the states are of no use.
bool solve_graph_problem(ceres::Problem& problem, const PoseGraphSolverParams& params,
                         PoseGraphSolution& solution);

}  // namespace hm::detail
