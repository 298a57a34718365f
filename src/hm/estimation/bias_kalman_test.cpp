#include "hm/estimation/bias_kalman.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "hm/core/rng.hpp"
#include "hm/estimation/testing/dense_kalman.hpp"
#include "hm/geometry/se2.hpp"

namespace hm {
namespace {

Mat2 turn(double angle) { return SE2(0, 0, angle).rotation(); }

Mat6 covariance_of(const BiasKalman<2>& filter) {
  Mat6 p;
  p.block<2, 2>(0, 0) = filter.pp;
  p.block<2, 2>(0, 2) = filter.pv;
  p.block<2, 2>(0, 4) = filter.pb;
  p.block<2, 2>(2, 2) = filter.vv;
  p.block<2, 2>(2, 4) = filter.vb;
  p.block<2, 2>(4, 4) = filter.bb;
  return p.selfadjointView<Eigen::Upper>();
}

Vec6 mean_of(const BiasKalman<2>& filter) {
  Vec6 x;
  x.segment<2>(0) = filter.position;
  x.segment<2>(2) = filter.velocity;
  x.segment<2>(4) = filter.bias;
  return x;
}

/// p' = v, v' = R (a - b) + noise, b' = noise.
DiscreteModel model(const Mat2& rotation, const NoiseDensity& noise, double dt_s) {
  Mat6 f = Mat6::Zero(), density = Mat6::Zero();
  f.block<2, 2>(0, 2).setIdentity();
  f.block<2, 2>(2, 4) = -rotation;
  density.diagonal().segment<2>(2).setConstant(noise.input);
  density.diagonal().segment<2>(4).setConstant(noise.bias);
  return van_loan(f, density, dt_s);
}

TEST(BiasKalman, IsTheTextbookFilterWithVanLoansNoise) {
  Rng rng(1);
  const NoiseDensity noise{0.3, 0.05};
  BiasKalman<2> filter;
  Mat2 first;
  first << 0.04, 0.01, 0.01, 0.09;
  filter.start({1, 2}, first, {1.5, 0.4});
  DenseKalman dense{mean_of(filter), covariance_of(filter)};
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(2, 6);
  h.leftCols(2).setIdentity();
  for (int i = 0; i < 400; ++i) {
    const double dt_s = rng.uniform(0.001, 0.2);
    const Mat2 rotation = turn(rng.uniform(-3, 3));
    const Vec2 a(rng.normal(), rng.normal());
    const DiscreteModel discrete = model(rotation, noise, dt_s);
    Eigen::VectorXd input = Eigen::VectorXd::Zero(6);
    input.head<2>() = 0.5 * dt_s * dt_s * (rotation * a);
    input.segment<2>(2) = dt_s * (rotation * a);
    filter.predict(a, rotation, dt_s, noise);
    dense.predict(discrete.a, input, discrete.q);
    const double scale = dense.p.cwiseAbs().maxCoeff();
    ASSERT_LT((covariance_of(filter) - dense.p).cwiseAbs().maxCoeff(), 1e-9 * scale) << i;
    if (i % 3 == 0) {
      Mat2 r;
      r << 0.02, rng.uniform(-0.01, 0.01), 0, 0.03;
      r(1, 0) = r(0, 1);
      const Vec2 z = filter.position + Vec2(rng.normal(0, 0.2), rng.normal(0, 0.2));
      const auto innovation = filter.innovation(z, r);
      const Vec2 residual = z - dense.x.head<2>();
      const Mat2 s = Mat2(dense.p.topLeftCorner<2, 2>()) + r;
      ASSERT_NEAR(innovation.chi2, residual.dot(s.inverse() * residual), 1e-6 * (1 + innovation.chi2));
      filter.correct(innovation);
      dense.correct(h, residual, r);
    }
    ASSERT_LT((mean_of(filter) - dense.x).norm(), 1e-7) << i;
  }
}

TEST(BiasKalman, TwoHalfStepsAreOneStep) {
  // Physical noise: the covariance after a second does not depend on the IMU rate.
  BiasKalman<1> coarse, fine;
  using Scalar = BiasKalman<1>::Vector;
  for (auto* filter : {&coarse, &fine}) filter->start(Scalar(0.0), Scalar(0.01), {1, 0.2});
  coarse.predict(Scalar(0.7), Scalar(1.0), 1.0, {0.1, 0.02});
  for (int i = 0; i < 1000; ++i) fine.predict(Scalar(0.7), Scalar(1.0), 0.001, {0.1, 0.02});
  EXPECT_NEAR(coarse.position(0), fine.position(0), 1e-9);
  EXPECT_NEAR(coarse.pp(0), fine.pp(0), 1e-9);
  EXPECT_NEAR(coarse.vv(0), fine.vv(0), 1e-9);
  EXPECT_NEAR(coarse.pb(0), fine.pb(0), 1e-9);
  EXPECT_NEAR(coarse.bb(0), fine.bb(0), 1e-9);
}

TEST(YawBiasKalman, IsTheTextbookFilterAndWraps) {
  Rng rng(4);
  const NoiseDensity noise{0.01, 0.001};
  YawBiasKalman filter;
  filter.start(3.0, 0.01, 0.1);
  DenseKalman dense{Eigen::Vector2d(3.0, 0), Eigen::Vector2d(0.01, 0.01).asDiagonal()};
  Eigen::MatrixXd f(2, 2), density(2, 2), h(1, 2);
  f << 0, -1, 0, 0;
  density << noise.input, 0, 0, noise.bias;
  h << 1, 0;
  for (int i = 0; i < 500; ++i) {
    const double dt_s = rng.uniform(0.001, 0.1), rate = rng.normal(0.5, 1);
    const auto discrete = van_loan(f, density, dt_s);
    filter.predict(rate, dt_s, noise);
    dense.predict(discrete.a, Eigen::Vector2d(dt_s * rate, 0), discrete.q);
    const double error = rng.normal(0, 0.2), measured = wrap_angle(dense.x(0) + error);
    const auto innovation = filter.innovation(measured, 0.04);
    ASSERT_NEAR(innovation.residual, wrap_angle(error), 1e-9);
    filter.correct(innovation);
    dense.correct(h, Eigen::VectorXd::Constant(1, error), Eigen::MatrixXd::Constant(1, 1, 0.04));
    ASSERT_NEAR(wrap_angle(filter.yaw_rad - dense.x(0)), 0, 1e-9);
    ASSERT_LE(std::abs(filter.yaw_rad), std::numbers::pi);
    ASSERT_NEAR(filter.bias_rad_s, dense.x(1), 1e-9);
    ASSERT_NEAR(filter.yy, dense.p(0, 0), 1e-12);
    ASSERT_NEAR(filter.yb, dense.p(0, 1), 1e-12);
    ASSERT_NEAR(filter.bb, dense.p(1, 1), 1e-12);
  }
}

/// The filter in a world that is exactly its model; the squared error in units of the covariance at the end.
double normalised_error(std::uint64_t seed) {
  Rng rng(seed);
  const NoiseDensity noise{0.2, 0.01};
  const double dt_s = 0.01, position_std = 0.05;
  BiasKalman<2> filter;
  Vec2 p(rng.normal(), rng.normal()), v(rng.normal(0, 1), rng.normal(0, 1)),
      b(rng.normal(0, 0.3), rng.normal(0, 0.3));
  const Mat2 r = position_std * position_std * Mat2::Identity();
  const auto measured = [&] {
    return Vec2(p + Vec2(rng.normal(0, position_std), rng.normal(0, position_std)));
  };
  filter.start(measured(), r, {1, 0.3});
  // Noise of the truth drawn from the model's discrete covariance.
  const Mat2 rotation = turn(0.7);
  const Eigen::MatrixXd root = model(rotation, noise, dt_s).q.llt().matrixL();
  for (int i = 1; i <= 500; ++i) {
    const Vec2 a(std::sin(0.05 * i), 1);  // as measured, without noise: the truth has it
    Eigen::VectorXd w(6);
    for (int k = 0; k < 6; ++k) w(k) = rng.normal();
    w = root * w;
    const Vec2 acceleration = rotation * (a - b);
    p += dt_s * v + 0.5 * dt_s * dt_s * acceleration + w.head<2>();
    v += dt_s * acceleration + w.segment<2>(2);
    b += w.tail<2>();
    filter.predict(a, rotation, dt_s, noise);
    if (i % 3 == 0) filter.correct(filter.innovation(measured(), r));
  }
  Vec6 error = -mean_of(filter);
  error.segment<2>(0) += p;
  error.segment<2>(2) += v;
  error.segment<2>(4) += b;
  return error.dot(covariance_of(filter).inverse() * error);
}

TEST(BiasKalman, KnowsHowWellItKnows) {
  const int runs = 200;
  double sum = 0;
  for (int seed = 1; seed <= runs; ++seed) sum += normalised_error(static_cast<std::uint64_t>(seed));
  // Chi square with 6 x 200 degrees of freedom: mean 6, standard deviation sqrt(12 / 200); a band of 3.3
  // sigma.
  EXPECT_NEAR(sum / runs, 6, 3.3 * std::sqrt(12.0 / runs));
}

TEST(BiasKalman, ABiasIsSeenThroughATurnAndKeptOverARestart) {
  BiasKalman<2> filter;
  const Vec2 bias(0.2, -0.1);
  Vec2 p = Vec2::Zero(), v = Vec2::Zero();
  const Mat2 r = 1e-4 * Mat2::Identity();
  filter.start(p, r, {1, 0.3});
  for (int i = 1; i <= 4000; ++i) {
    const Mat2 rotation = turn(0.001 * i);
    const Vec2 a(std::cos(0.01 * i), std::sin(0.003 * i));
    p += 0.005 * v + 0.5 * 0.005 * 0.005 * (rotation * a);
    v += 0.005 * (rotation * a);
    filter.predict(a + bias, rotation, 0.005, {1e-4, 1e-8});
    if (i % 5 == 0) filter.correct(filter.innovation(p, r));
  }
  EXPECT_LT((filter.bias - bias).norm(), 0.01);
  EXPECT_LT((filter.velocity - v).norm(), 0.01);
  const Mat2 known = filter.bb;
  filter.start({7, 7}, r, {1, 0.3});
  EXPECT_LT((filter.bias - bias).norm(), 0.01);
  EXPECT_EQ(filter.bb, known);
  EXPECT_EQ(filter.velocity, Vec2(0, 0));
}

}  // namespace
}  // namespace hm
