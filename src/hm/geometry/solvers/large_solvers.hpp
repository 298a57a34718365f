#pragma once
#include <Eigen/Core>

namespace hm {

// Eigen's solvers for systems of more than six unknowns, compiled once (small_solvers.hpp: those of fewer).
// Results are bit-identical to Eigen's.

/// Solution x of A x = b for a symmetric, positive or negative semidefinite A of any size (Eigen::LDLT), of
/// which only the lower triangle is read.
struct SymmetricSolution {
  Eigen::VectorXd x;
  bool is_factorised = false;  ///< false: Eigen reports a numerical issue, and x is arbitrary
};
SymmetricSolution symmetric_solution(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
/// Solution X of A X = B, the same for each column; of a numerical issue nothing is reported.
Eigen::MatrixXd symmetric_solutions(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
/// Inverse of a symmetric A of any size by symmetric_solutions(), made symmetric.
Eigen::MatrixXd inverse_of_symmetric(const Eigen::MatrixXd& A);

/// Matrix inverse (Eigen: LU with partial pivoting).
Eigen::Matrix<double, 9, 9> inverse_of(const Eigen::Matrix<double, 9, 9>& A);

}  // namespace hm
