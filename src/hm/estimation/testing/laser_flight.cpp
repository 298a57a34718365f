#include "hm/estimation/testing/laser_flight.hpp"

#include <cmath>

#include "hm/core/testing/drawn_vector.hpp"

namespace hm {
namespace {

/// The direction of flight swings to and fro.
double course_rad(double time_s) { return 2.0 * std::sin(0.8 * time_s); }
double course_rate_rad_s(double time_s) { return 1.6 * std::cos(0.8 * time_s); }
double yaw_rad(double time_s) { return 3.0 + 0.8 * std::sin(0.5 * time_s); }  // passes pi
constexpr double kClimbAmplitude_m = 0.3, kClimbRate_rad_s = 1.1;

}  // namespace

FlightTruth LaserFlight::truth_at(double time_s, const Vec3& position) const {
  FlightTruth truth;
  const double course = course_rad(time_s), speed = params_.speed_m_s;
  truth.position_m = {position.x(), position.y(),
                      1.5 + kClimbAmplitude_m * std::sin(kClimbRate_rad_s * time_s)};
  truth.velocity_m_s = {speed * std::cos(course), speed * std::sin(course),
                        kClimbAmplitude_m * kClimbRate_rad_s * std::cos(kClimbRate_rad_s * time_s)};
  truth.acceleration_m_s2 = {
      -speed * course_rate_rad_s(time_s) * std::sin(course),
      speed * course_rate_rad_s(time_s) * std::cos(course),
      -kClimbAmplitude_m * kClimbRate_rad_s * kClimbRate_rad_s * std::sin(kClimbRate_rad_s * time_s)};
  // A multirotor pushes along its z axis.
  const Vec3 z = (truth.acceleration_m_s2 + Vec3(0, 0, kGravity_m_s2)).normalized();
  const Vec3 heading(std::cos(yaw_rad(time_s)), std::sin(yaw_rad(time_s)), 0);
  const Vec3 y = z.cross(heading).normalized();
  truth.R_world_base << y.cross(z), y, z;
  return truth;
}

LaserFlight::LaserFlight(const LaserFlightParams& params) : params_(params) {
  Rng rng(params.seed);
  const double dt = 1 / params.imu_hz;
  const auto count = static_cast<std::size_t>(params.duration_s * params.imu_hz);
  const auto every = static_cast<std::size_t>(params.imu_hz / params.laser_hz);
  const auto delay = static_cast<std::size_t>(params.laser_delay_s * params.imu_hz);
  Vec3 position = Vec3::Zero();
  const auto noise = [&](double sigma) { return test::drawn<3>([&] { return rng.normal(0, sigma); }); };
  steps_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double end_s = static_cast<double>(i) * dt, middle_s = end_s - 0.5 * dt;
    const FlightTruth before = truth_at(end_s - dt, position);
    const FlightTruth middle = truth_at(middle_s, position);
    // Simpson's rule for the path.
    position +=
        dt / 6 * (before.velocity_m_s + 4 * middle.velocity_m_s + truth_at(end_s, position).velocity_m_s);
    Step& step = steps_[i];
    step.truth = truth_at(end_s, position);
    step.imu.stamp = Time::from_seconds(end_s);
    step.imu.angular_velocity_rad_s =
        so3_log(before.R_world_base.transpose() * step.truth.R_world_base) / dt +
        Vec3(0, 0, params.yaw_rate_bias_rad_s) + noise(params.angular_rate_noise_rad_s);
    step.imu.specific_force_m_s2 =
        middle.R_world_base.transpose() * (middle.acceleration_m_s2 + Vec3(0, 0, kGravity_m_s2)) +
        params.acceleration_bias_m_s2 + noise(params.acceleration_noise_m_s2);
    if (params.orientation_from_imu) step.imu.R_world_imu = step.truth.R_world_base * so3_exp(noise(0.002));
    if (i % every != 0) continue;
    const Vec3 error = noise(params.position_std_m);
    PlanarPose pose;
    pose.stamp = step.imu.stamp;
    pose.T_odom_base = SE2(step.truth.position_m.x() + error.x(), step.truth.position_m.y() + error.y(),
                           roll_pitch_yaw(step.truth.R_world_base).z() + rng.normal(0, params.yaw_std_rad));
    pose.covariance =
        Vec3(params.position_std_m * params.position_std_m, params.position_std_m * params.position_std_m,
             params.yaw_std_rad * params.yaw_std_rad)
            .asDiagonal();
    if (i + delay < count) steps_[i + delay].pose = pose;
    if (i + every / 2 < count)
      steps_[i + every / 2].height =
          HeightReading{step.imu.stamp, step.truth.position_m.z() + rng.normal(0, params.height_std_m),
                        params.height_std_m};
  }
}

void feed(StateEstimator& estimator, const LaserFlight::Step& step) {
  estimator.add_imu(step.imu);
  if (step.pose) estimator.add_pose(*step.pose);
  if (step.height) estimator.add_height(*step.height);
}

double velocity_rmse_m_s(const LaserFlight& flight, const StateEstimatorParams& params, double from_s) {
  StateEstimator estimator(params);
  double squares = 0;
  std::size_t count = 0;
  for (const auto& step : flight.steps()) {
    feed(estimator, step);
    if (step.imu.stamp.seconds() < from_s) continue;
    squares += (estimator.state().velocity_m_s - step.truth.velocity_m_s).squaredNorm();
    ++count;
  }
  return std::sqrt(squares / static_cast<double>(count));
}

}  // namespace hm
