#include "hm/estimation/alpha_beta.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "hm/core/rng.hpp"
#include "hm/geometry/se2.hpp"

namespace hm {
namespace {

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
Time at(double seconds) { return Time::from_seconds(seconds); }
using One = AlphaBetaHeight::Vector;

TEST(AlphaBeta, FollowsItsEquations) {
  AlphaBetaHeight filter({0.7, 0.3, 1.0});
  Rng rng(1);
  double x = 0, v = 0, time_s = 0;
  for (int i = 0; i < 200; ++i) {
    const double dt_s = rng.uniform(0.01, 0.1), z = rng.normal(0, 2);
    time_s = i == 0 ? 0 : time_s + dt_s;
    filter.update(at(time_s), One(z));
    if (i == 0) {
      x = z;
    } else {
      const double predicted = x + dt_s * v, residual = z - predicted;
      x = predicted + 0.7 * residual;
      v = v + 0.3 / dt_s * residual;
    }
    ASSERT_NEAR(filter.position()(0), x, 1e-6);
    ASSERT_NEAR(filter.velocity()(0), v, 1e-4);
  }
}

TEST(AlphaBeta, FirstSampleHasNoVelocityAndARampIsFollowedWithoutLag) {
  AlphaBetaPosition filter;
  EXPECT_EQ(filter.update(at(5), Vec3(10, -20, 30)), AlphaBetaStatus::kFirst);
  EXPECT_EQ(filter.velocity(), Vec3::Zero());
  EXPECT_EQ(filter.position(), Vec3(10, -20, 30));
  const Vec3 velocity(1, -2, 0.5);
  for (int i = 1; i < 100; ++i) filter.update(at(5 + 0.03 * i), Vec3(10, -20, 30) + 0.03 * i * velocity);
  EXPECT_LT((filter.velocity() - velocity).norm(), 1e-6);
  EXPECT_LT((filter.position() - Vec3(10, -20, 30) - 0.03 * 99 * velocity).norm(), 1e-8);
  EXPECT_LT((filter.predicted(at(5 + 0.03 * 99 + 1)) - filter.position() - velocity).norm(), 1e-6);
}

TEST(AlphaBeta, BadSamplesChangeNothing) {
  AlphaBetaHeight filter;
  filter.update(at(1), One(1));
  filter.update(at(1.1), One(1.2));
  const double x = filter.position()(0), v = filter.velocity()(0);
  EXPECT_EQ(filter.update(at(1.1), One(7)), AlphaBetaStatus::kTimeBackwards);  // dt = 0 would divide
  EXPECT_EQ(filter.update(at(0.5), One(7)), AlphaBetaStatus::kTimeBackwards);
  EXPECT_EQ(filter.update(at(1.2), One(kNoNumber)), AlphaBetaStatus::kInvalid);
  EXPECT_EQ(filter.position()(0), x);
  EXPECT_EQ(filter.velocity()(0), v);
  EXPECT_EQ(filter.update(at(1.2), One(1.3)), AlphaBetaStatus::kUpdated);
}

TEST(AlphaBeta, AGapStartsAnew) {
  AlphaBetaHeight filter({0.9, 0.5, 0.5});
  filter.update(at(0), One(0));
  filter.update(at(0.1), One(1));
  EXPECT_GT(filter.velocity()(0), 1);
  EXPECT_EQ(filter.update(at(0.7), One(3)), AlphaBetaStatus::kRestarted);
  EXPECT_EQ(filter.position()(0), 3);
  EXPECT_EQ(filter.velocity()(0), 0);
}

TEST(AlphaBetaAngle, TurnsThroughPi) {
  AlphaBetaAngle filter;
  for (int i = 0; i < 400; ++i) {
    filter.update(at(0.05 * i), wrap_angle(0.7 * 0.05 * i));
    if (i > 100) {
      ASSERT_NEAR(filter.rate_rad_s(), 0.7, 1e-9);
      ASSERT_NEAR(wrap_angle(filter.angle_rad() - 0.7 * 0.05 * i), 0, 1e-9);
    }
    ASSERT_LE(std::abs(filter.angle_rad()), std::numbers::pi);
  }
  EXPECT_EQ(filter.update(at(1000), kNoNumber), AlphaBetaStatus::kInvalid);
}

TEST(AlphaBetaOrientation, BlendsTheRateAndSlerpsTheAttitude) {
  const AlphaBetaParams params{0.6, 0.4, 1.0};
  AlphaBetaOrientation filter(params);
  const Vec3 axis = Vec3(1, 2, -3).normalized();
  Rng rng(3);
  double rate = 0, previous = 0;
  Eigen::Quaterniond expected = Eigen::Quaterniond::Identity();
  for (int i = 0; i < 100; ++i) {
    const double angle = rng.uniform(-0.5, 0.5);
    Eigen::Quaterniond measured(Eigen::AngleAxisd(angle, axis));
    if (i % 3 == 0) measured.coeffs() *= -2.0;  // the same rotation
    filter.update(at(0.1 * i), measured);
    measured.normalize();
    if (i == 0) {
      expected = measured;
      previous = angle;
      continue;
    }
    // The blend of the published orientation filter: the residual against the previous filtered attitude.
    const Eigen::Quaterniond predicted = expected * Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * rate, axis));
    rate = (1 - 0.4) * rate + 0.4 * (angle - previous) / 0.1;
    expected = predicted.slerp(0.6, measured);
    previous = axis.dot(rotation_vector(expected));
    ASSERT_LT(filter.R_world_body().angularDistance(expected), 1e-7);
    ASSERT_LT((filter.rate_body_rad_s() - rate * axis).norm(), 1e-6);
  }
}

TEST(AlphaBetaOrientation, RefusesWhatIsNoRotation) {
  AlphaBetaOrientation filter;
  EXPECT_EQ(filter.update(at(0), Eigen::Quaterniond(0, 0, 0, 0)), AlphaBetaStatus::kInvalid);
  EXPECT_EQ(filter.update(at(0), Eigen::Quaterniond(kNoNumber, 0, 0, 0)), AlphaBetaStatus::kInvalid);
  EXPECT_EQ(filter.update(at(0), Eigen::Quaterniond::Identity()), AlphaBetaStatus::kFirst);
}

TEST(RotationVector, IsTheInverseOfTurning) {
  Rng rng(5);
  for (int i = 0; i < 500; ++i) {
    const double scale = std::pow(10.0, rng.uniform(-10, 0.4));
    Vec3 v(rng.normal(), rng.normal(), rng.normal());
    v *= scale / v.norm();
    ASSERT_LT((rotation_vector(turned(Eigen::Quaterniond::Identity(), v)) - v).norm(), 1e-9 * scale + 1e-15);
    ASSERT_LT((turned(Eigen::Quaterniond::Identity(), v).toRotationMatrix() - so3_exp(v)).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace hm
