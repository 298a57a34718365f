// hm: compiled alone, as it takes as long as a unit of many files
#include "hm/geometry/solvers/small_solvers.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cstdlib>

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
    EXPECT_EQ(solve_symmetric_3(A, any.col(0)), Vec3(A.ldlt().solve(any.col(0))));
  }
}

}  // namespace
}  // namespace hm
