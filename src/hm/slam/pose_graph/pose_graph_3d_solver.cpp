#include "hm/slam/pose_graph/pose_graph_3d_solver.hpp"

#include <ceres/ceres.h>

#include <algorithm>
#include <numeric>

#include "hm/core/check.hpp"
#include "hm/slam/pose_graph/graph_problem.hpp"
#include "hm/slam/pose_graph/pose_edge_cost.hpp"
#include "hm/slam/pose_graph/pose_manifold.hpp"

namespace hm {
namespace {

using detail::PoseState;

bool all_finite(const PoseGraph3D& graph) {
  for (const SE3& node : graph.T_map_node)
    if (!node.translation().allFinite() || !node.rotation().allFinite()) return false;
  for (const PoseEdge3D& edge : graph.edges)
    if (!edge.T_from_to.translation().allFinite() || !edge.T_from_to.rotation().allFinite() ||
        !edge.information.allFinite())
      return false;
  return true;
}

void add_edges(const PoseGraph3D& graph, const PoseGraphSolverParams& params, std::vector<PoseState>& states,
               ceres::Problem& problem) {
  for (const PoseEdge3D& edge : graph.edges) {
    HM_CHECK(edge.from < states.size() && edge.to < states.size() && edge.from != edge.to,
             "edge from {} to {} of {} nodes", edge.from, edge.to, states.size());
    problem.AddResidualBlock(detail::new_pose_edge_cost(edge), detail::new_edge_loss(edge.kind, params),
                             states[edge.from].data(), states[edge.to].data());
  }
}

/// Loops with the largest chi2 over the limit, at most a tenth of all loops (at least one).
std::vector<std::size_t> worst_loops(const PoseGraph3D& graph, double max_loop_chi2) {
  std::vector<std::pair<double, std::size_t>> over;
  std::size_t loops = 0;
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    if (graph.edges[e].kind != PoseEdgeKind::kLoop) continue;
    ++loops;
    if (const double chi2 = pose_edge_chi2(graph.edges[e], graph); chi2 > max_loop_chi2)
      over.emplace_back(-chi2, e);
  }
  std::sort(over.begin(), over.end());
  over.resize(std::min(over.size(), std::max<std::size_t>(1, loops / 10)));
  std::vector<std::size_t> worst;
  for (const auto& [chi2, edge] : over) worst.push_back(edge);
  std::sort(worst.begin(), worst.end());
  return worst;
}

}  // namespace

Eigen::Matrix<double, 6, 12> pose_edge_jacobian(const PoseEdge3D& edge, const SE3& T_map_from,
                                                const SE3& T_map_to) {
  const SE3 T_from_to = T_map_from.inverse() * T_map_to;
  const Mat3 measured = edge.T_from_to.rotation().transpose();
  const Mat3 turn = detail::right_jacobian_inverse(so3_log(measured * T_from_to.rotation()));
  Eigen::Matrix<double, 6, 12> jacobian = Eigen::Matrix<double, 6, 12>::Zero();
  jacobian.block<3, 3>(0, 0) = -measured;
  jacobian.block<3, 3>(0, 3) = measured * skew(T_from_to.translation());
  jacobian.block<3, 3>(0, 6) = measured * T_from_to.rotation();
  jacobian.block<3, 3>(3, 3) = -turn * T_from_to.rotation().transpose();
  jacobian.block<3, 3>(3, 9) = turn;
  return jacobian;
}

PoseGraphSolution solve_pose_graph(PoseGraph3D& graph, const PoseGraphSolverParams& params,
                                   std::size_t held) {
  PoseGraphSolution solution;
  if (!detail::begin_solution(graph, all_finite(graph), solution)) return solution;
  std::vector<PoseState> states;
  for (const SE3& node : graph.T_map_node) states.push_back(detail::pose_state(node));
  ceres::Problem problem;
  add_edges(graph, params, states, problem);
  for (PoseState& state : states)
    if (problem.HasParameterBlock(state.data()))
      problem.SetManifold(state.data(), detail::new_pose_manifold());
  for (std::size_t i = 0; i < std::min(held, states.size()); ++i)
    if (problem.HasParameterBlock(states[i].data())) problem.SetParameterBlockConstant(states[i].data());
  if (!detail::solve_graph_problem(problem, params, solution)) return solution;
  for (std::size_t i = held; i < states.size(); ++i)
    if (problem.HasParameterBlock(states[i].data())) graph.T_map_node[i] = detail::pose_of(states[i].data());
  solution.final_chi2 = pose_graph_chi2(graph);
  return solution;
}

ContradictionResult solve_without_contradictions(PoseGraph3D& graph, double max_loop_chi2,
                                                 const PoseGraphSolverParams& params, std::size_t held) {
  ContradictionResult result;
  std::vector<std::size_t> original(graph.edges.size());
  std::iota(original.begin(), original.end(), std::size_t{0});
  while (true) {
    result.solution = solve_pose_graph(graph, params, held);
    const std::vector<std::size_t> worst = worst_loops(graph, max_loop_chi2);
    if (worst.empty()) break;
    for (auto at = worst.rbegin(); at != worst.rend(); ++at) {
      const auto place = static_cast<std::ptrdiff_t>(*at);
      result.removed.push_back(original[*at]);
      graph.edges.erase(graph.edges.begin() + place);
      original.erase(original.begin() + place);
    }
  }
  std::sort(result.removed.begin(), result.removed.end());
  return result;
}

}  // namespace hm
