#pragma once
#include <ceres/ceres.h>

#include <vector>

/// Shared by the least-squares problems of this room. Include only in .cpp files (Ceres is slow to compile).
namespace hm::detail {

/// Solver options: silent, and on one thread for reproducible results.
inline ceres::Solver::Options solver_options(ceres::LinearSolverType type, int max_iterations) {
  ceres::Solver::Options options;
  options.linear_solver_type = type;
  options.max_num_iterations = max_iterations;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  return options;
}

/// Residuals of some blocks without their loss function.
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
