// hm: compiled alone, as it takes as long as a unit of many files
#include <Eigen/Eigenvalues>

#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {

Eigen3 symmetric_eigen(const Mat3& A) {
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Vec3 symmetric_eigenvalues(const Mat3& A) {
  return Eigen::SelfAdjointEigenSolver<Mat3>(A, Eigen::EigenvaluesOnly).eigenvalues();
}

}  // namespace hm
