#include "hm/estimation/vehicle_estimator.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <limits>
#include <memory>
#include <new>

#include "hm/estimation/testing/laser_flight.hpp"

// Every allocation of this test program is counted; the address sanitizer has a heap of its own.
#ifdef HM_SANITIZED
constexpr bool kCounting = false;
#else
constexpr bool kCounting = true;
#endif
namespace {
std::atomic<std::size_t> allocations{0};
}  // namespace
#ifndef HM_SANITIZED
static void* counted(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  std::abort();
}
void* operator new(std::size_t size) { return counted(size); }
void* operator new[](std::size_t size) { return counted(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
#endif

namespace hm {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(StateEstimator, DelayCompensationMakesTheVelocityThreeTimesBetter) {
  const LaserFlight flight{LaserFlightParams{}};
  StateEstimatorParams params;
  const double with = velocity_rmse_m_s(flight, params);
  params.fusion.delay_compensation = false;
  const double without = velocity_rmse_m_s(flight, params);
  EXPECT_LT(with, 0.05);
  EXPECT_LT(with, without / 3);
  params.mode = FusionMode::kThesis;
  params.thesis = DecoupledKalmanParams::city_flyer();
  EXPECT_LT(with, velocity_rmse_m_s(flight, params) / 3);
}

TEST(StateEstimator, EstimatesTheNineStatesAndTheBiases) {
  const LaserFlight flight{LaserFlightParams{}};
  const auto estimator = std::make_unique<StateEstimator>();
  for (const auto& step : flight.steps()) {
    feed(*estimator, step);
    if (step.imu.stamp.seconds() < 3) continue;
    const VehicleState state = estimator->state();
    ASSERT_LT((state.position_m - step.truth.position_m).norm(), 0.05);
    ASSERT_LT((state.velocity_m_s - step.truth.velocity_m_s).norm(), 0.2);
    ASSERT_LT(so3_log(state.T_odom_base().rotation().transpose() * step.truth.R_world_base).norm(), 0.03);
    ASSERT_EQ(state.stamp, step.imu.stamp);
  }
  const VehicleState state = estimator->state();
  EXPECT_TRUE(state.planar_ready && state.height_ready);
  EXPECT_LT((state.acceleration_bias_m_s2 - Vec3(0.1, -0.08, 0.15)).norm(), 0.05);
  EXPECT_NEAR(state.yaw_rate_bias_rad_s, 0.01, 0.003);
  EXPECT_EQ(estimator->pose_counts().rejected, 0u);
}

TEST(StateEstimator, FindsItsTiltInCurvesWithoutTheImusOrientation) {
  LaserFlightParams flight_params;
  flight_params.orientation_from_imu = false;
  const LaserFlight flight(flight_params);
  EXPECT_LT(velocity_rmse_m_s(flight, {}, 10), 0.15);
  const auto estimator = std::make_unique<StateEstimator>();
  double largest_rad = 0;
  for (const auto& step : flight.steps()) {
    feed(*estimator, step);
    if (step.imu.stamp.seconds() < 10) continue;
    const Mat3 wrong = estimator->state().T_odom_base().rotation().transpose() * step.truth.R_world_base;
    largest_rad = std::max(largest_rad, so3_log(wrong).norm());
  }
  EXPECT_LT(largest_rad, 0.08);  // tilts reach 0.31
}

TEST(StateEstimator, IsDeterministic) {
  LaserFlightParams flight_params;
  flight_params.duration_s = 3;
  const LaserFlight flight(flight_params);
  VehicleState states[2];
  for (VehicleState& state : states) {
    const auto estimator = std::make_unique<StateEstimator>();
    for (const auto& step : flight.steps()) feed(*estimator, step);
    state = estimator->state();
  }
  EXPECT_EQ(states[0].position_m, states[1].position_m);
  EXPECT_EQ(states[0].velocity_m_s, states[1].velocity_m_s);
  EXPECT_EQ(states[0].planar_covariance, states[1].planar_covariance);
}

TEST(StateEstimator, AllocatesNothing) {
  if (!kCounting) GTEST_SKIP() << "the address sanitizer counts for itself";
  LaserFlightParams flight_params;
  flight_params.duration_s = 2;
  for (const bool orientation : {true, false}) {
    flight_params.orientation_from_imu = orientation;
    const LaserFlight flight(flight_params);
    for (const FusionMode mode : {FusionMode::kThesis, FusionMode::kDelayAware}) {
      StateEstimatorParams params;
      params.mode = mode;
      const auto estimator = std::make_unique<StateEstimator>(params);
      double sum = 0;
      const std::size_t before = allocations;
      for (const auto& step : flight.steps()) {
        feed(*estimator, step);
        sum += estimator->state().velocity_m_s.x();
      }
      estimator->add_pose({flight.steps().front().imu.stamp, SE2(kNan, 0, 0), {}});
      EXPECT_EQ(allocations - before, 0u);
      EXPECT_NE(sum, 0);
    }
  }
}

/// A vehicle standing level or tilted, its IMU mounted as given.
ImuSample resting(double time_s, const Mat3& R_world_base, const SE3& T_base_imu) {
  ImuSample sample;
  sample.stamp = Time::from_seconds(time_s);
  sample.specific_force_m_s2 = (R_world_base * T_base_imu.rotation()).transpose() * Vec3(0, 0, kGravity_m_s2);
  return sample;
}

TEST(StateEstimator, TiltFromGravityThroughTheMounting) {
  const SE3 T_base_imu(rotation_from_roll_pitch_yaw({3.0, 0.2, -1.0}), Vec3(0.1, 0, 0.05));
  const Mat3 R_world_base = rotation_from_roll_pitch_yaw({0.1, -0.2, 0});
  const auto estimator = std::make_unique<StateEstimator>(StateEstimatorParams{}, T_base_imu);
  for (int i = 0; i < 500; ++i) {
    EXPECT_NE(estimator->add_imu(resting(0.01 * i, R_world_base, T_base_imu)), FusionStatus::kInvalid);
    if (i % 5 == 0) estimator->add_pose({Time::from_seconds(0.01 * i), SE2(1, 2, 0.5), {}});
    if (i % 5 == 0) estimator->add_height({Time::from_seconds(0.01 * i), 1.0, {}});
  }
  const VehicleState state = estimator->state();
  EXPECT_NEAR(state.roll_pitch_yaw_rad.x(), 0.1, 1e-6);
  EXPECT_NEAR(state.roll_pitch_yaw_rad.y(), -0.2, 1e-6);
  EXPECT_NEAR(state.roll_pitch_yaw_rad.z(), 0.5, 1e-3);
  EXPECT_LT(state.velocity_m_s.norm(), 1e-3);
  EXPECT_LT((state.position_m - Vec3(1, 2, 1)).norm(), 1e-3);
  EXPECT_LT(state.acceleration_bias_m_s2.norm(), 1e-3);
}

TEST(TiltFilter, GravityPullsBackWhatTheGyroscopeLoses) {
  TiltFilter filter;
  const double gyro_bias_rad_s = 0.01;
  for (int i = 0; i < 60000; ++i)
    filter.update({gyro_bias_rad_s, 0, 0}, {0, 0, kGravity_m_s2}, i == 0 ? 0 : 0.001);
  const Vec3 angles = roll_pitch_yaw(filter.R_world_body().toRotationMatrix());
  EXPECT_NEAR(angles.x(), gyro_bias_rad_s * TiltFilterParams{}.time_constant_s,
              1e-3);  // first order: bias * time constant
  EXPECT_NEAR(angles.y(), 0, 1e-6);
}

TEST(TiltFilter, FollowsATurnAndIgnoresForcesThatAreNotGravity) {
  TiltFilter filter;
  filter.update(Vec3::Zero(), {0, 0, 3.0}, 0);
  EXPECT_FALSE(filter.ready());
  filter.update(Vec3::Zero(), {0, 0, kGravity_m_s2}, 0);
  EXPECT_TRUE(filter.ready());
  for (int i = 0; i < 1000; ++i) filter.update({0.3, 0, 0}, {8, 8, 15}, 0.001);
  const Vec3 angles = roll_pitch_yaw(filter.R_world_body().toRotationMatrix());
  EXPECT_NEAR(angles.x(), 0.3, 1e-9);
}

TEST(StateEstimator, BadImuSamplesAreCountedAndIgnored) {
  for (const FusionMode mode : {FusionMode::kThesis, FusionMode::kDelayAware}) {
    StateEstimatorParams params;
    params.mode = mode;
    const auto estimator = std::make_unique<StateEstimator>(params);
    const Mat3 level = Mat3::Identity();
    estimator->add_pose({Time::from_seconds(0.5), SE2(1, 2, 0), {}});
    for (int i = 0; i < 10; ++i) estimator->add_imu(resting(1 + 0.01 * i, level, {}));
    const VehicleState before = estimator->state();
    ImuSample broken = resting(2, level, {});
    broken.specific_force_m_s2.x() = kNan;
    EXPECT_EQ(estimator->add_imu(broken), FusionStatus::kInvalid);
    broken = resting(2, level, {});
    broken.R_world_imu = Mat3::Constant(kNan);
    EXPECT_EQ(estimator->add_imu(broken), FusionStatus::kInvalid);
    EXPECT_EQ(estimator->add_imu(resting(1.05, level, {})), FusionStatus::kTimeBackwards);
    EXPECT_EQ(estimator->add_pose({Time::from_seconds(1.05), SE2(kNan, 0, 0), {}}), FusionStatus::kInvalid);
    EXPECT_EQ(estimator->add_height({Time::from_seconds(1.05), kNan, {}}), FusionStatus::kInvalid);
    EXPECT_EQ(estimator->state().position_m, before.position_m);
    EXPECT_EQ(estimator->imu_counts().invalid, 2u);
    EXPECT_EQ(estimator->imu_counts().time_backwards, 1u);
    EXPECT_EQ(estimator->imu_counts().accepted, 10u);
  }
}

TEST(StateEstimator, WithoutAnImuItGoesOnWithTheVelocityOfTheLaser) {
  const auto estimator = std::make_unique<StateEstimator>();
  for (int i = 0; i <= 100; ++i) {
    const Time stamp = Time::from_seconds(0.05 * i);
    estimator->advance(stamp);
    estimator->add_pose({stamp, SE2(0.5 * 0.05 * i, 0, 0), {}});
  }
  EXPECT_NEAR(estimator->state().velocity_m_s.x(), 0.5, 0.03);
  EXPECT_LT(estimator->state().acceleration_bias_m_s2.norm(), 1e-9);  // not observable without measurements
  EXPECT_EQ(estimator->advance(Time::from_seconds(4)), FusionStatus::kTimeBackwards);
  const double x = estimator->state().position_m.x(), v = estimator->state().velocity_m_s.x();
  estimator->advance(Time::from_seconds(6));
  EXPECT_NEAR(estimator->state().position_m.x(), x + v, 1e-6);
}

TEST(StateEstimator, ThesisModeIsAlphaBetaThenKalman) {
  StateEstimatorParams params;
  params.mode = FusionMode::kThesis;
  const auto estimator = std::make_unique<StateEstimator>(params);
  AlphaBetaFilter<2> alpha_beta(params.pose_alpha_beta);
  DecoupledKalman kalman(params.thesis);
  kalman.reset_planar({1, 1}, 0);
  for (int i = 1; i <= 300; ++i) {
    ImuSample sample = resting(0.001 * i, Mat3::Identity(), {});
    sample.R_world_imu = Mat3::Identity();
    sample.specific_force_m_s2.x() += 0.7;
    estimator->add_imu(sample);
    if (i > 1) kalman.predict({0.7, 0, 0}, 0, 0.001);
    if (i == 1 || i % 33 == 0) {
      const SE2 pose(1 + 1e-4 * i, 1, 0);
      estimator->add_pose({sample.stamp, pose, {}});
      alpha_beta.update(sample.stamp, pose.translation());
      if (i == 1) kalman.reset_planar({pose.x(), pose.y()}, 0);
      kalman.correct_planar(alpha_beta.position(), alpha_beta.velocity(), 0);
    }
    ASSERT_NEAR(estimator->state().position_m.x(), kalman.position_m().x(), 1e-9);
    ASSERT_NEAR(estimator->state().velocity_m_s.x(), kalman.velocity_m_s().x(), 1e-9);
  }
}

}  // namespace
}  // namespace hm
