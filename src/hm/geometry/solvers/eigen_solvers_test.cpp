// hm: compiled alone, as it takes as long as a unit of many files
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <cstdlib>

#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

TEST(SmallSolvers, GiveEigensBitsOfEigenvectors) {
  std::srand(7);
  for (int i = 0; i < 50; ++i) {
    const Mat3 any = Mat3::Random();
    const Mat6 any6 = Mat6::Random();
    const Mat3 A = any * any.transpose();
    const Mat6 A6 = any6 * any6.transpose();
    const Eigen::SelfAdjointEigenSolver<Mat3> of_3(A);
    EXPECT_EQ(symmetric_eigen(A).values, of_3.eigenvalues());
    EXPECT_EQ(symmetric_eigen(A).vectors, of_3.eigenvectors());
    const Eigen::SelfAdjointEigenSolver<Mat6> of_6(A6);
    EXPECT_EQ(symmetric_eigen(A6).values, of_6.eigenvalues());
    EXPECT_EQ(symmetric_eigen(A6).vectors, of_6.eigenvectors());
    EXPECT_EQ(symmetric_eigenvalues(A6), of_6.eigenvalues());
    EXPECT_EQ(symmetric_eigenvalues(A), of_3.eigenvalues());
    const Eigen::JacobiSVD<Mat3> svd(any, Eigen::ComputeFullU | Eigen::ComputeFullV);
    EXPECT_EQ(svd_of(any).U, svd.matrixU());
    EXPECT_EQ(svd_of(any).V, svd.matrixV());
    EXPECT_EQ(svd_of(any).values, svd.singularValues());
    EXPECT_EQ(svd_of(any).values, Eigen::JacobiSVD<Mat3>(any).singularValues());
  }
}

}  // namespace
}  // namespace hm
