// The estimator of the microcontroller (float, 38 moments of 5 ms, 16 measurements) against the one of the
// host.
#include <gtest/gtest.h>

#include <limits>
#include <memory>

#include "hm/estimation/testing/laser_flight.hpp"

namespace hm {
namespace {

InertialReading<float> narrowed(const ImuSample& sample) {
  InertialReading<float> reading{sample.stamp,
                                 sample.angular_velocity_rad_s.cast<float>(),
                                 sample.specific_force_m_s2.cast<float>(),
                                 {}};
  if (sample.R_world_imu) reading.R_world_imu = sample.R_world_imu->cast<float>();
  return reading;
}
PoseReading<float> narrowed(const PlanarPose& pose) {
  PoseReading<float> reading{pose.stamp, pose.T_odom_base.vector().cast<float>(), {}};
  if (pose.covariance) reading.covariance = pose.covariance->cast<float>();
  return reading;
}
BasicHeightReading<float> narrowed(const HeightReading& height) {
  return {height.stamp, static_cast<float>(height.height_m), static_cast<float>(height.std_m.value_or(0.01))};
}

BasicStateEstimatorParams<float> board_params() {
  BasicStateEstimatorParams<float> params;
  params.fusion.max_delay_s = 0.18F;  // of the 190 ms that fit
  return params;
}

void feed(BoardEstimator& estimator, const LaserFlight::Step& step) {
  estimator.add_imu(narrowed(step.imu));
  if (step.pose) estimator.add_pose(narrowed(*step.pose));
  if (step.height) estimator.add_height(narrowed(*step.height));
}

/// Largest difference between both estimators, and errors of the float one, from 3 s on.
struct Difference {
  double position_m = 0, velocity_m_s = 0, angle_rad = 0, bias_m_s2 = 0;
  double position_error_m = 0, velocity_error_m_s = 0, sigma_ratio = 1;
};

Difference compare(const LaserFlight& flight, const StateEstimatorParams& params,
                   const BasicStateEstimatorParams<float>& board) {
  const auto host = std::make_unique<StateEstimator>(params);
  const auto narrow = std::make_unique<BoardEstimator>(board);
  Difference worst;
  for (const auto& step : flight.steps()) {
    feed(*host, step);
    feed(*narrow, step);
    if (step.imu.stamp.seconds() < 3) continue;
    const VehicleState a = host->state();
    const BasicVehicleState<float> b = narrow->state();
    const auto grow = [](double& most, double value) { most = std::max(most, value); };
    grow(worst.position_m, (a.position_m - b.position_m.cast<double>()).norm());
    grow(worst.velocity_m_s, (a.velocity_m_s - b.velocity_m_s.cast<double>()).norm());
    for (int axis = 0; axis < 3; ++axis)
      grow(worst.angle_rad, std::abs(wrap_angle(a.roll_pitch_yaw_rad(axis) -
                                                static_cast<double>(b.roll_pitch_yaw_rad(axis)))));
    grow(worst.bias_m_s2, (a.acceleration_bias_m_s2 - b.acceleration_bias_m_s2.cast<double>()).norm());
    grow(worst.position_error_m, (b.position_m.cast<double>() - step.truth.position_m).norm());
    grow(worst.velocity_error_m_s, (b.velocity_m_s.cast<double>() - step.truth.velocity_m_s).norm());
    grow(worst.sigma_ratio,
         std::sqrt(std::max(a.planar_covariance(0, 0) / static_cast<double>(b.planar_covariance(0, 0)),
                            static_cast<double>(b.planar_covariance(0, 0)) / a.planar_covariance(0, 0))));
  }
  EXPECT_EQ(narrow->pose_counts().accepted, host->pose_counts().accepted);
  EXPECT_EQ(narrow->pose_counts().rejected, host->pose_counts().rejected);
  EXPECT_EQ(narrow->pose_counts().too_old, 0u);
  return worst;
}

TEST(BoardEstimator, DiffersFromTheHostsByMillimetres) {
  for (const bool orientation : {true, false}) {
    LaserFlightParams params;
    params.orientation_from_imu = orientation;
    const Difference worst = compare(LaserFlight(params), {}, board_params());
    EXPECT_LT(worst.position_m, 0.004);
    EXPECT_LT(worst.velocity_m_s, 0.02);
    EXPECT_LT(worst.angle_rad, 0.002);
    EXPECT_LT(worst.bias_m_s2, 0.01);
    EXPECT_LT(worst.sigma_ratio, 1.05);
    if (!orientation) continue;  // whose own tilt takes ten seconds to settle
    EXPECT_LT(worst.position_error_m, 0.05);
    EXPECT_LT(worst.velocity_error_m_s, 0.2);
  }
}

TEST(BoardEstimator, FliesThePublishedFiltersToo) {
  StateEstimatorParams params;
  BasicStateEstimatorParams<float> board = board_params();
  params.mode = board.mode = FusionMode::kThesis;
  params.thesis = DecoupledKalmanParams::city_flyer();
  board.thesis = BasicDecoupledKalmanParams<float>::city_flyer();
  const Difference worst = compare(LaserFlight(LaserFlightParams{}), params, board);
  EXPECT_LT(worst.position_m, 1e-4);
  EXPECT_LT(worst.velocity_m_s, 1e-3);
}

TEST(BoardEstimator, HoldsLongFlightsWithoutLosingDigits) {
  LaserFlightParams params;
  params.duration_s = 120;
  const Difference worst = compare(LaserFlight(params), {}, board_params());
  EXPECT_LT(worst.position_m, 0.004);
  EXPECT_LT(worst.sigma_ratio, 1.05);
}

/// Poses and heights of a standing vehicle, each `delay_ms` after its stamp; 1 kHz inputs that are summed.
std::unique_ptr<BasicDelayedFusion<float, kBoardCapacity>> standing_with_delay(int delay_ms) {
  auto fusion = std::make_unique<BasicDelayedFusion<float, kBoardCapacity>>(board_params().fusion);
  const auto at_ms = [](int ms) { return Time{std::int64_t{1'000'000} * ms}; };
  const auto wave = [](int ms) { return sin_cos_f(0.1F * static_cast<float>(ms)).sin; };
  for (int ms = 1; ms <= 3000; ++ms) {
    BasicFusionInput<float> input;
    input.stamp = at_ms(ms);
    input.acceleration_level_m_s2 = {0.1F * wave(ms), 0.2F * wave(2 * ms), 0.3F * wave(3 * ms)};
    input.yaw_rate_rad_s = 0.1F * wave(5 * ms);
    fusion->add_input(input);
    const int stamp_ms = ms == 1 ? 1 : ms - delay_ms;  // everybody starts from the same first two
    if (stamp_ms <= 1 && ms != 1) continue;
    if (stamp_ms > 2800) continue;
    const float noise = 0.02F * wave(7 * stamp_ms);
    if (stamp_ms % 25 == 1) fusion->add_pose({at_ms(stamp_ms), {1 + noise, 2 - noise, 0.5F * noise}, {}});
    if (stamp_ms % 30 == 1) fusion->add_height({at_ms(stamp_ms), 1.5F + noise, {}});
  }
  return fusion;
}

TEST(BoardEstimator, TheOrderOfArrivalDoesNotChangeABit) {
  const auto prompt = standing_with_delay(0), late = standing_with_delay(110);
  EXPECT_EQ(prompt->pose_counts().accepted + prompt->pose_counts().rejected, 112u);
  EXPECT_EQ(prompt->pose_counts().accepted, late->pose_counts().accepted);
  EXPECT_EQ(prompt->height_counts().accepted, late->height_counts().accepted);
  EXPECT_EQ(prompt->state().planar.position, late->state().planar.position);
  EXPECT_EQ(prompt->state().planar.velocity, late->state().planar.velocity);
  EXPECT_EQ(prompt->state().planar.pp, late->state().planar.pp);
  EXPECT_EQ(prompt->state().vertical.position, late->state().vertical.position);
  EXPECT_EQ(prompt->state().yaw.yaw_rad, late->state().yaw.yaw_rad);
}

TEST(BoardEstimator, FitsTheMemoryOfAMicrocontroller) {
  // 16 kB for the whole autopilot (flight.md 11), of which 12 are for the estimator.
  EXPECT_LE(sizeof(BoardEstimator), 12u * 1024u);
  using Fusion = BasicDelayedFusion<float, kBoardCapacity>;
  EXPECT_LE(sizeof(Fusion) / kBoardCapacity.inputs, 235u);
  RecordProperty("bytes", static_cast<int>(sizeof(BoardEstimator)));
}

TEST(BoardEstimator, NothingInvalidReachesItsState) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  LaserFlightParams flight_params;
  flight_params.duration_s = 2;
  const LaserFlight flight(flight_params);
  const auto estimator = std::make_unique<BoardEstimator>(board_params());
  const auto clean = std::make_unique<BoardEstimator>(board_params());
  for (const auto& step : flight.steps()) {
    feed(*clean, step);
    feed(*estimator, step);
    InertialReading<float> broken = narrowed(step.imu);
    broken.stamp = broken.stamp + Duration{300};
    broken.specific_force_m_s2.y() = nan;
    EXPECT_EQ(estimator->add_imu(broken), FusionStatus::kInvalid);
    EXPECT_EQ(estimator->add_imu(narrowed(step.imu)), FusionStatus::kTimeBackwards);
    EXPECT_EQ(estimator->add_height({step.imu.stamp, nan, 0.01F}), FusionStatus::kInvalid);
    EXPECT_EQ(estimator->add_pose({step.imu.stamp, {nan, 0, 0}, {}}), FusionStatus::kInvalid);
  }
  EXPECT_EQ(estimator->state().position_m, clean->state().position_m);
  EXPECT_EQ(estimator->state().velocity_m_s, clean->state().velocity_m_s);
  EXPECT_EQ(estimator->imu_counts().invalid, flight.steps().size());
}

TEST(BoardEstimator, AGapIsBridgedAndMakesUncertain) {
  LaserFlightParams flight_params;
  flight_params.duration_s = 2;
  const LaserFlight flight(flight_params);
  const auto estimator = std::make_unique<BoardEstimator>(board_params());
  for (const auto& step : flight.steps()) feed(*estimator, step);
  const auto before = estimator->state();
  InertialReading<float> later = narrowed(flight.steps().back().imu);
  later.stamp = later.stamp + Duration::from_seconds(0.5);
  EXPECT_EQ(estimator->add_imu(later), FusionStatus::kGap);
  const auto after = estimator->state();
  EXPECT_GT(after.planar_covariance(0, 0), 10 * before.planar_covariance(0, 0));
  EXPECT_LT((after.position_m - before.position_m - 0.5F * before.velocity_m_s).norm(), 0.01F);
}

}  // namespace
}  // namespace hm
