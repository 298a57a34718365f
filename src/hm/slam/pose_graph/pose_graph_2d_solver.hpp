#pragma once
#include <cstddef>
#include <string>

#include "hm/geometry/pose_graph_2d.hpp"

namespace hm {

struct PoseGraphSolverParams {
  int max_iterations = 100;
  /// Scale of the Cauchy loss of loop edges, in chi2; 0: plain least squares.
  double loop_loss_chi2 = 0;
};

struct PoseGraphSolution {
  bool converged = false;
  int iterations = 0;
  double initial_chi2 = 0, final_chi2 = 0;  ///< without robust loss
  std::string message;                      ///< solver message for the log
};

/// Optimises the nodes by least squares (Levenberg-Marquardt, sparse Cholesky; Kuemmerle et al., ICRA 2011).
/// The first `held` nodes and nodes without edges are fixed. Edges must refer to nodes of the graph. If the
/// input is not finite or a factorisation fails, the result is not converged and the nodes are unchanged.
/// Single-threaded, deterministic.
PoseGraphSolution solve_pose_graph(PoseGraph2D& graph, const PoseGraphSolverParams& params = {},
                                   std::size_t held = 1);

/// Derivatives of pose_edge_error with respect to (x, y, angle) of both nodes, 3 x 6; for tests.
Eigen::Matrix<double, 3, 6> pose_edge_jacobian(const PoseEdge2D& edge, const SE2& T_map_from,
                                               const SE2& T_map_to);

}  // namespace hm
