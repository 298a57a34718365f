// hm: compiled alone, as it takes as long as a unit of many files
#include <gtest/gtest.h>

#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

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
