#pragma once
#include <cstddef>
#include <vector>

#include "hm/geometry/pose_graph_3d.hpp"
#include "hm/slam/pose_graph/pose_graph_2d_solver.hpp"

namespace hm {

/// Moves the nodes to the least squares optimum of pose_edge_error (Levenberg-Marquardt on SE(3), analytic
/// Jacobians, sparse Cholesky). The first `held` nodes stay; nodes that no edge reaches stay. Not finite
/// input or a failed factorisation: not converged, nodes as they were. Edges must name nodes of the graph.
/// One thread, deterministic.
PoseGraphSolution solve_pose_graph(PoseGraph3D& graph, const PoseGraphSolverParams& params = {},
                                   std::size_t held = 1);

/// Solves, takes out loops whose chi2 is over `max_loop_chi2` (worst first, at most a tenth of the loops at a
/// time) and solves again until none is left. The indices of the edges taken out, in the graph as it was
/// given, ascending.
struct ContradictionResult {
  PoseGraphSolution solution;  ///< of the last round
  std::vector<std::size_t> taken_out;
};
ContradictionResult solve_without_contradictions(PoseGraph3D& graph, double max_loop_chi2,
                                                 const PoseGraphSolverParams& params = {},
                                                 std::size_t held = 1);

/// Derivatives of pose_edge_error by the moves (moved_by) of both nodes: 6 x 12.
Eigen::Matrix<double, 6, 12> pose_edge_jacobian(const PoseEdge3D& edge, const SE3& T_map_from,
                                                const SE3& T_map_to);

}  // namespace hm
