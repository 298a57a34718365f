// hm: compiled alone, as it takes as long as a unit of many files
#include <Eigen/Eigenvalues>

#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {

Eigen6 symmetric_eigen(const Mat6& A) {
  const Eigen::SelfAdjointEigenSolver<Mat6> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Vec6 symmetric_eigenvalues(const Mat6& A) {
  return Eigen::SelfAdjointEigenSolver<Mat6>(A, Eigen::EigenvaluesOnly).eigenvalues();
}

}  // namespace hm
