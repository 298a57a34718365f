#pragma once
#include <ceres/ceres.h>

#include <vector>

/// What the room's problems have in common; for .cpp files (Ceres takes long to compile).
namespace hm::detail {

/// Silent and on one thread: the same result on any machine.
inline ceres::Solver::Options solver_options(ceres::LinearSolverType type, int max_iterations) {
  ceres::Solver::Options options;
  options.linear_solver_type = type;
  options.max_num_iterations = max_iterations;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  return options;
}

/// The residuals of some blocks as they are, without their loss.
inline std::vector<double> residuals_of(ceres::Problem& problem,
                                        const std::vector<ceres::ResidualBlockId>& blocks) {
  ceres::Problem::EvaluateOptions options;
  options.residual_blocks = blocks;
  options.apply_loss_function = false;
  std::vector<double> values;
  problem.Evaluate(options, nullptr, &values, nullptr, nullptr);
  return values;
}

}  // namespace hm::detail
