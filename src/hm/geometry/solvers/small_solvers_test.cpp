#include "hm/geometry/solvers/small_solvers.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>

namespace hm {
namespace {

TEST(SmallSolvers, GiveEigensBits) {
  std::srand(7);
  for (int i = 0; i < 50; ++i) {
    const Mat3 any = Mat3::Random();
    const Mat6 any6 = Mat6::Random();
    const Mat3 A = any * any.transpose();
    const Mat6 A6 = any6 * any6.transpose();
    const Vec6 b = Vec6::Random();
    EXPECT_EQ(solve_symmetric(A6, b), Vec6(A6.ldlt().solve(b)));
    EXPECT_EQ(inverse_of(A6), Mat6(A6.inverse()));
    const Eigen::SelfAdjointEigenSolver<Mat3> of_3(A);
    EXPECT_EQ(symmetric_eigen(A).values, of_3.eigenvalues());
    EXPECT_EQ(symmetric_eigen(A).vectors, of_3.eigenvectors());
    const Eigen::SelfAdjointEigenSolver<Mat6> of_6(A6);
    EXPECT_EQ(symmetric_eigen(A6).values, of_6.eigenvalues());
    EXPECT_EQ(symmetric_eigen(A6).vectors, of_6.eigenvectors());
    EXPECT_EQ(symmetric_eigenvalues(A6), of_6.eigenvalues());
    EXPECT_EQ(symmetric_eigenvalues(A), of_3.eigenvalues());
    const Eigen::JacobiSVD<Mat3> svd(any, Eigen::ComputeFullU | Eigen::ComputeFullV);
    EXPECT_EQ(solve_symmetric_3(A, any.col(0)), A.ldlt().solve(any.col(0)));
    EXPECT_EQ(svd_of(any).U, svd.matrixU());
    EXPECT_EQ(svd_of(any).V, svd.matrixV());
    EXPECT_EQ(svd_of(any).values, svd.singularValues());
    EXPECT_EQ(svd_of(any).values, Eigen::JacobiSVD<Mat3>(any).singularValues());
  }
}

TEST(SmallSolvers, TurnBetweenDirections) {
  const Vec3 from(0.3, -2, 1), to(1, 1, 0.2);
  EXPECT_LT((turn_between(from, to) * from.normalized() - to.normalized()).norm(), 1e-12);
  EXPECT_EQ(turn_between(from, to).coeffs(), Eigen::Quaterniond::FromTwoVectors(from, to).coeffs());
  EXPECT_EQ(turn_between(from, 3 * from).coeffs(),
            Eigen::Quaterniond::FromTwoVectors(from, 3 * from).coeffs());
  const Eigen::Quaterniond opposite = turn_between(from, -from);
  EXPECT_LT((opposite * from + from).norm(), 1e-12);
  EXPECT_NEAR(opposite.norm(), 1, 1e-12);
}

}  // namespace
}  // namespace hm
