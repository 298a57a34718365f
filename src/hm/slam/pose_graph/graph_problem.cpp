#include "hm/slam/pose_graph/graph_problem.hpp"

#include <ceres/ceres.h>

#include <cmath>

namespace hm::detail {

ceres::LossFunction* new_edge_loss(PoseEdgeKind kind, const PoseGraphSolverParams& params) {
  if (kind != PoseEdgeKind::kLoop || params.loop_loss_chi2 <= 0) return nullptr;
  return new ceres::CauchyLoss(std::sqrt(params.loop_loss_chi2));
}

bool solve_graph_problem(ceres::Problem& problem, const PoseGraphSolverParams& params,
                         PoseGraphSolution& solution) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.num_threads = 1;
  options.max_num_iterations = params.max_iterations;
  options.function_tolerance = 1e-8;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  solution.message = summary.message;
  solution.iterations = static_cast<int>(summary.iterations.size()) - 1;
  solution.converged = summary.termination_type == ceres::CONVERGENCE;
  return summary.IsSolutionUsable();
}

}  // namespace hm::detail
