#pragma once
#include <cstddef>
#include <vector>

#include "hm/geometry/pose_graph_3d.hpp"
#include "hm/slam/pose_graph/pose_graph_2d_solver.hpp"

namespace hm {

/// Optimises the nodes by least squares of pose_edge_error (Levenberg-Marquardt on SE(3), analytic Jacobians,
/// sparse Cholesky). The first `held` nodes and nodes without edges are fixed. Edges must refer to nodes of
/// the graph. If the input is not finite or a factorisation fails, the result is not converged and the nodes
/// are unchanged. Single-threaded, deterministic.
PoseGraphSolution solve_pose_graph(PoseGraph3D& graph, const PoseGraphSolverParams& params = {},
                                   std::size_t held = 1);

/// Optimises the graph, removes loops whose chi2 exceeds `max_loop_chi2` (worst first, at most a tenth of the
/// loops at a time) and repeats until none is left. `removed`: ascending indices of the removed edges in
/// the original graph.
struct ContradictionResult {
  PoseGraphSolution solution;  ///< of the last optimisation
  std::vector<std::size_t> removed;
};
ContradictionResult solve_without_contradictions(PoseGraph3D& graph, double max_loop_chi2,
                                                 const PoseGraphSolverParams& params = {},
                                                 std::size_t held = 1);

/// Derivatives of pose_edge_error with respect to perturbations (moved_by) of both nodes: 6 x 12.
Eigen::Matrix<double, 6, 12> pose_edge_jacobian(const PoseEdge3D& edge, const SE3& T_map_from,
                                                const SE3& T_map_to);

}  // namespace hm
