#include "hm/odometry/inertial/inertial_factors.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <functional>

#include "hm/odometry/testing/carried_device.hpp"

namespace hm {
namespace {

const double kFirst_s = 1.0, kSecond_s = 1.3;

struct Pair {
  InertialState first, second;
  InertialCommon common;
  std::vector<ImuSample> readings =
      carried_readings(0.8, 1.5, 200, {Vec3(0.01, -0.02, 0.015), Vec3(0.1, 0.05, -0.2)});

  Pair() {
    first = {CarriedPath::pose(kFirst_s), CarriedPath::velocity_m_s(kFirst_s)};
    second = {CarriedPath::pose(kSecond_s), CarriedPath::velocity_m_s(kSecond_s)};
    common.bias = {Vec3(0.01, -0.02, 0.015), Vec3(0.1, 0.05, -0.2)};
  }
  [[nodiscard]] InertialResidual residual() const {
    const auto between = preintegrate(readings, Time::from_seconds(kFirst_s), Time::from_seconds(kSecond_s),
                                      common.delay_s, common.bias, {});
    EXPECT_TRUE(between);
    return inertial_residual(first, second, common, *between);
  }
};

/// All states moved as a body: turned by `turn` about the origin, then shifted.
Pair moved(Pair pair, const Vec3& turn, const Vec3& shift, bool gravity_too = false) {
  const SE3 motion(so3_exp(turn), shift);
  for (InertialState* state : {&pair.first, &pair.second}) {
    state->T_odom_camera = motion * state->T_odom_camera;
    state->velocity_m_s = motion.rotation() * state->velocity_m_s;
  }
  if (gravity_too) pair.common.R_odom_level = motion.rotation() * pair.common.R_odom_level;
  return pair;
}

TEST(InertialFactors, AreZeroOnThePath) {
  const Pair pair;
  EXPECT_LT(pair.residual().value.norm(), 1e-4);
  const auto between = preintegrate(pair.readings, Time::from_seconds(kFirst_s),
                                    Time::from_seconds(kSecond_s), 0, pair.common.bias, {});
  const InertialState end = propagated(pair.first, pair.common, *between);
  EXPECT_LT(inertial_residual(pair.first, end, pair.common, *between).value.norm(), 1e-12);
  EXPECT_LT(end.minus(pair.second).norm(), 1e-4);
}

TEST(InertialFactors, DerivativesAreTheNumericalOnes) {
  Pair pair;  // away from the minimum
  Vec9 off;
  off << 0.02, -0.01, 0.03, 0.05, -0.04, 0.02, 0.1, -0.2, 0.1;
  pair.second = pair.second.moved(off);
  const InertialResidual residual = pair.residual();
  constexpr double kStep = 1e-5;
  const auto column = [&](const std::function<void(Pair&, const Vec9&)>& move, int axis) {
    Pair more = pair, less = pair;
    move(more, kStep * Vec9::Unit(axis));
    move(less, -kStep * Vec9::Unit(axis));
    return Vec9((more.residual().value - less.residual().value) / (2 * kStep));
  };
  for (int axis = 0; axis < 9; ++axis) {
    const Vec9 by_first = column([](Pair& p, const Vec9& d) { p.first = p.first.moved(d); }, axis);
    const Vec9 by_second = column([](Pair& p, const Vec9& d) { p.second = p.second.moved(d); }, axis);
    const Vec9 by_common = column([](Pair& p, const Vec9& d) { p.common = p.common.moved(d); }, axis);
    EXPECT_LT((by_first - residual.by_first.col(axis)).norm(), 1e-5) << axis;
    EXPECT_LT((by_second - residual.by_second.col(axis)).norm(), 1e-5) << axis;
    // The readings at the ends are those of a line between two: the derivative by the delay jumps there.
    EXPECT_LT((by_common - residual.by_common.col(axis)).norm(), axis == 8 ? 0.03 : 1e-4) << axis;
  }
}

/// Yaw and position are not observable: moving all states by such a motion changes no residual. Roll, pitch
/// and velocity are.
TEST(InertialFactors, DoNotSeeYawAndPosition) {
  const Pair pair;
  const Vec9 value = pair.residual().value;
  EXPECT_LT((moved(pair, Vec3(0, 0, 0.7), Vec3(3, -2, 1)).residual().value - value).norm(), 1e-12);
  EXPECT_LT((moved(pair, Vec3(0.2, -0.3, 0.7), Vec3(3, -2, 1), true).residual().value - value).norm(), 1e-12);
  EXPECT_GT((moved(pair, Vec3(0.01, 0, 0), Vec3::Zero()).residual().value - value).norm(), 0.01);
  Pair faster = pair;
  faster.first.velocity_m_s.x() += 0.1, faster.second.velocity_m_s.x() += 0.1;
  EXPECT_GT((faster.residual().value - value).norm(), 0.02);
}

/// The same of the derivatives, with gravity held: four directions without effect.
TEST(InertialFactors, HaveANullSpaceOfFour) {
  const Pair pair;
  const InertialResidual residual = pair.residual();
  Eigen::Matrix<double, 9, 18> J;
  J << residual.by_first, residual.by_second;
  Eigen::Matrix<double, 18, 4> null = Eigen::Matrix<double, 18, 4>::Zero();
  int row = 0;
  for (const InertialState* state : {&pair.first, &pair.second}) {
    null.block<3, 3>(row, 0).setIdentity();
    null.block<3, 1>(row, 3) = Vec3::UnitZ().cross(state->T_odom_camera.translation());
    null.block<3, 1>(row + 3, 3) = state->T_odom_camera.rotation().transpose() * Vec3::UnitZ();
    null.block<3, 1>(row + 6, 3) = Vec3::UnitZ().cross(state->velocity_m_s);
    row += 9;
  }
  EXPECT_LT((J * null).norm(), 1e-9);
  EXPECT_EQ(Eigen::FullPivLU<Eigen::MatrixXd>(J).rank(), 9);
}

}  // namespace
}  // namespace hm
