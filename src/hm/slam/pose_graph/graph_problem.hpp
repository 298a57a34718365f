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

/// Square root R of an information matrix R^T R, which may be singular.
template <int kSize>
Eigen::Matrix<double, kSize, kSize> information_root(const Eigen::Matrix<double, kSize, kSize>& information) {
  const auto solved = symmetric_eigen(information);
  return solved.values.cwiseMax(0).cwiseSqrt().asDiagonal() * solved.vectors.transpose();
}

/// Creates the loss function of an edge: Cauchy for loops if set in the parameters, else none (null). Owned
/// by the caller.
ceres::LossFunction* new_edge_loss(PoseEdgeKind kind, const PoseGraphSolverParams& params);

/// Initialises the solution. Returns false when there is nothing to optimise: the graph is not finite or has
/// no edges.
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

/// Solves the problem of a pose graph (sparse Cholesky, one thread) and sets message, iterations and
/// converged. Returns false when the states are unusable.
bool solve_graph_problem(ceres::Problem& problem, const PoseGraphSolverParams& params,
                         PoseGraphSolution& solution);

}  // namespace hm::detail
