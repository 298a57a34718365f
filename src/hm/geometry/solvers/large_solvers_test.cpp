// hm: compiled alone, as it takes as long as a unit of many files
#include "hm/geometry/solvers/large_solvers.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cstdlib>

namespace hm {
namespace {

TEST(LargeSolvers, GiveEigensBits) {
  std::srand(7);
  for (const Eigen::Index size : {1, 5, 18, 60}) {
    const Eigen::MatrixXd any = Eigen::MatrixXd::Random(size, size), A = any * any.transpose();
    const Eigen::VectorXd b = Eigen::VectorXd::Random(size);
    const Eigen::LDLT<Eigen::MatrixXd> factors(A);
    const SymmetricSolution solution = symmetric_solution(A, b);
    EXPECT_TRUE(solution.is_factorised);
    EXPECT_EQ(solution.x, Eigen::VectorXd(factors.solve(b)));
    Eigen::MatrixXd lower = A;
    lower.triangularView<Eigen::StrictlyUpper>().setConstant(7);
    EXPECT_EQ(symmetric_solution(lower, b).x,
              Eigen::VectorXd(A.selfadjointView<Eigen::Lower>().ldlt().solve(b)));
    EXPECT_EQ(symmetric_solutions(A, any), Eigen::MatrixXd(factors.solve(any)));
    EXPECT_EQ(symmetric_solutions(A, Eigen::MatrixXd::Identity(size, size)),
              Eigen::MatrixXd(factors.solve(Eigen::MatrixXd::Identity(size, size))));
  }
  const Eigen::MatrixXd A = (Eigen::MatrixXd(2, 2) << 4, 1, 1, 2).finished();
  EXPECT_LT((inverse_of_symmetric(A) * A - Eigen::MatrixXd::Identity(2, 2)).norm(), 1e-14);
  EXPECT_EQ(inverse_of_symmetric(A), inverse_of_symmetric(A).transpose());
  const Eigen::Matrix<double, 9, 9> any9 = Eigen::Matrix<double, 9, 9>::Random();
  EXPECT_EQ(inverse_of(any9), (Eigen::Matrix<double, 9, 9>(any9.inverse())));
}

TEST(LargeSolvers, TellWhereNothingWasFactorised) {
  Eigen::MatrixXd indefinite(2, 2);  // no pivot on its diagonal
  indefinite << 0, 1, 1, 0;
  EXPECT_FALSE(symmetric_solution(indefinite, Eigen::VectorXd::Ones(2)).is_factorised);
}

}  // namespace
}  // namespace hm
