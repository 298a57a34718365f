// hm: compiled alone, as it takes as long as a unit of many files
#include "hm/geometry/solvers/large_solvers.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace hm {

SymmetricSolution symmetric_solution(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  const Eigen::LDLT<Eigen::MatrixXd> factors(A);
  return {factors.solve(b), factors.info() == Eigen::Success};
}

Eigen::MatrixXd symmetric_solutions(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B) {
  return Eigen::LDLT<Eigen::MatrixXd>(A).solve(B);
}

Eigen::MatrixXd inverse_of_symmetric(const Eigen::MatrixXd& A) {
  const Eigen::MatrixXd inverse = symmetric_solutions(A, Eigen::MatrixXd::Identity(A.rows(), A.cols()));
  return 0.5 * (inverse + inverse.transpose());
}

Eigen::Matrix<double, 9, 9> inverse_of(const Eigen::Matrix<double, 9, 9>& A) { return A.inverse(); }

}  // namespace hm
