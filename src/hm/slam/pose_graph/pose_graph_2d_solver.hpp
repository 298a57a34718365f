#pragma once
#include <cstddef>
#include <string>

#include "hm/geometry/pose_graph_2d.hpp"

namespace hm {

struct PoseGraphSolverParams {
  int max_iterations = 100;
  double loop_loss_chi2 =
      0;  ///< beyond it a loop edge loses its influence (Cauchy loss); 0: plain least squares
};

struct PoseGraphSolution {
  bool converged = false;
  int iterations = 0;
  double initial_chi2 = 0, final_chi2 = 0;  ///< without loss
  std::string message;                      ///< of the solver, for the log
};

/// Moves the nodes to the least squares optimum (Levenberg-Marquardt, sparse Cholesky; Kuemmerle et al., ICRA
/// 2011). The first `held` nodes of the graph stay; nodes that no edge reaches stay. Not finite input or a
/// failed factorisation: not converged, nodes as they were. Edges must name nodes of the graph. One thread,
/// deterministic.
PoseGraphSolution solve_pose_graph(PoseGraph2D& graph, const PoseGraphSolverParams& params = {},
                                   std::size_t held = 1);

/// Derivatives of pose_edge_error by (x, y, angle) of both nodes, for tests: 3 x 6.
Eigen::Matrix<double, 3, 6> pose_edge_jacobian(const PoseEdge2D& edge, const SE2& T_map_from,
                                               const SE2& T_map_to);

}  // namespace hm
