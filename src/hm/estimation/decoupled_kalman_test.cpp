#include "hm/estimation/decoupled_kalman.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "hm/core/rng.hpp"
#include "hm/estimation/testing/dense_kalman.hpp"
#include "hm/geometry/se2.hpp"

namespace hm {
namespace {

constexpr double kStep_s = 0.001;

/// Runs until the gains no longer change: `steps` predictions of 1 ms between corrections.
DecoupledKalman settled(const DecoupledKalmanParams& params, int steps) {
  DecoupledKalman filter(params);
  for (int i = 0; i < 2000; ++i) {
    for (int k = 0; k < steps; ++k) filter.predict(Vec3::Zero(), 0, kStep_s);
    filter.correct_planar(Vec2::Zero(), Vec2::Zero(), 0);
    filter.correct_height(0, 0);
  }
  return filter;
}

TEST(DecoupledKalman, HasTheSteadyStateGainsOfTheFlownVehicle) {
  const auto at_30_hz = settled(DecoupledKalmanParams::city_flyer(), 33);
  EXPECT_NEAR(at_30_hz.x().gain()(0, 0), 0.671, 5e-4);
  EXPECT_NEAR(at_30_hz.x().gain()(1, 1), 0.671, 5e-4);
  EXPECT_NEAR(at_30_hz.y().gain()(0, 0), 0.671, 5e-4);
  EXPECT_NEAR(at_30_hz.yaw().gain(), 0.671, 5e-4);
  const auto at_40_hz = settled(DecoupledKalmanParams::city_flyer(), 25);
  EXPECT_NEAR(at_40_hz.z().gain()(0, 0), 1.000, 5e-4);
  EXPECT_NEAR(at_40_hz.z().gain()(1, 1), 0.656, 5e-4);
}

TEST(DecoupledKalman, IsTheTextbookFilterOfSevenStates) {
  DecoupledKalmanParams params;
  params.x = {0.01, 0.5, 3.0};
  params.y = {0.2, 1.5, 4.0};
  params.z = {0.7, 0.1, 9.0};
  params.q_yaw = 0.001;
  params.r_yaw = 0.3;
  DecoupledKalman filter(params);
  filter.reset_planar({1, 2}, 3);
  filter.reset_height(4);
  DenseKalman dense{Eigen::VectorXd::Zero(7), Eigen::MatrixXd::Identity(7, 7)};
  dense.x << 1, 0, 2, 0, 4, 0, 3;
  Eigen::VectorXd q(7), r(7);
  q << 0.01, 0.01, 0.2, 0.2, 0.7, 0.7, 0.001;
  r << 0.5, 3, 1.5, 4, 0.1, 9, 0.3;
  Rng rng(2);
  for (int i = 0; i < 3000; ++i) {
    const double dt_s = rng.uniform(0.0005, 0.01);
    const Vec3 a(rng.normal(), rng.normal(), rng.normal());
    const double rate = rng.normal(0, 0.1);
    Eigen::MatrixXd f = Eigen::MatrixXd::Identity(7, 7);
    Eigen::VectorXd input(7);
    for (int axis = 0; axis < 3; ++axis) {
      f(2 * axis, 2 * axis + 1) = dt_s;
      input(2 * axis) = 0.5 * dt_s * dt_s * a(axis);
      input(2 * axis + 1) = dt_s * a(axis);
    }
    input(6) = dt_s * rate;
    filter.predict(a, rate, dt_s);
    dense.predict(f, input, q.asDiagonal());
    if (i % 7 == 0) {
      Eigen::VectorXd z(7);
      for (int k = 0; k < 6; ++k) z(k) = rng.normal();
      z(6) = dense.x(6) + rng.uniform(-1, 1);
      filter.correct_planar({z(0), z(2)}, {z(1), z(3)}, z(6));
      filter.correct_height(z(4), z(5));
      dense.correct(Eigen::MatrixXd::Identity(7, 7), z - dense.x, r.asDiagonal());
    }
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_NEAR(filter.position_m()(axis), dense.x(2 * axis), 1e-9);
      ASSERT_NEAR(filter.velocity_m_s()(axis), dense.x(2 * axis + 1), 1e-9);
    }
    ASSERT_LT((filter.y().covariance() - dense.p.block<2, 2>(2, 2)).norm(), 1e-9);
    ASSERT_NEAR(filter.yaw().variance(), dense.p(6, 6), 1e-12);
    ASSERT_NEAR(wrap_angle(filter.yaw().yaw_rad() - dense.x(6)), 0, 1e-9);
  }
}

TEST(DecoupledKalman, YawStaysInOneTurnAndTheResidualIsShort) {
  DecoupledKalman filter;
  filter.reset_planar(Vec2::Zero(), 0.1);
  filter.correct_planar(Vec2::Zero(), Vec2::Zero(), 2 * std::numbers::pi - 0.1);
  EXPECT_LT(std::abs(wrap_angle(filter.yaw().yaw_rad())), 0.1);  // not half a turn away
  for (int i = 0; i < 20000; ++i) {
    filter.predict(Vec3::Zero(), i < 10000 ? -2.3 : 2.9, kStep_s);
    ASSERT_GE(filter.yaw().yaw_rad(), 0);
    ASSERT_LT(filter.yaw().yaw_rad(), 2 * std::numbers::pi);
  }
  filter.reset_planar(Vec2::Zero(), -1e-20);
  EXPECT_LT(filter.yaw().yaw_rad(), 2 * std::numbers::pi);
}

// The first implementation latched its noise at a reset, so that changing it in flight did nothing.
TEST(DecoupledKalman, NewNoiseCountsFromTheNextStep) {
  DecoupledKalman filter;
  filter.predict(Vec3::Zero(), 0, kStep_s);
  DecoupledKalmanParams sure;
  sure.z.r_position = 1e-6;
  sure.z.r_velocity = 1e9;
  filter.set_params(sure);
  filter.correct_height(5, 0);
  EXPECT_NEAR(filter.position_m().z(), 5, 1e-4);
  EXPECT_NEAR(filter.z().gain()(1, 1), 0, 1e-6);
}

// It also kept the position when it was reset.
TEST(DecoupledKalman, ResetClearsStatesAndCovariances) {
  DecoupledKalman filter;
  for (int i = 0; i < 100; ++i) filter.predict(Vec3(1, 2, 3), 1, 0.01);
  filter.correct_planar({9, 9}, {9, 9}, 1);
  filter.reset_planar({1, 2}, 0.5);
  filter.reset_height(3);
  EXPECT_EQ(filter.position_m(), Vec3(1, 2, 3));
  EXPECT_EQ(filter.velocity_m_s(), Vec3::Zero());
  EXPECT_EQ(filter.yaw().yaw_rad(), 0.5);
  EXPECT_EQ(filter.x().covariance(), Mat2(Mat2::Identity()));
}

TEST(DecoupledKalman, BrokenInputsChangeNothing) {
  DecoupledKalman filter;
  filter.reset_planar({1, 2}, 0.5);
  filter.predict(Vec3(1, 2, 3), 0.1, kStep_s);
  const Vec3 position = filter.position_m(), velocity = filter.velocity_m_s();
  const double nan = std::nan("");
  filter.predict(Vec3::Ones(), 0.1, 0);
  filter.predict(Vec3::Constant(nan), nan, kStep_s);
  filter.correct_planar({nan, 1}, {0, nan}, nan);
  filter.correct_height(nan, 0);
  EXPECT_EQ(filter.position_m(), position);
  EXPECT_EQ(filter.velocity_m_s(), velocity);
  EXPECT_TRUE(std::isfinite(filter.yaw().yaw_rad()));
}

}  // namespace
}  // namespace hm
