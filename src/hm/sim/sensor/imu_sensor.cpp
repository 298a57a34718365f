#include "hm/sim/sensor/imu_sensor.hpp"

#include <cmath>

namespace hm {
namespace {

constexpr std::uint64_t kStream = 0x696d75;
constexpr double kTiltCorrelation_s = 10;

}  // namespace

ImuSample exact_imu(const FlightState& state, const SE3& T_base_imu) {
  const Vec3& arm = T_base_imu.translation();
  const Vec3 &w = state.angular_velocity_base_rad_s, &dw = state.angular_acceleration_base_rad_s2;
  const Mat3 R_base_world = state.T_world_base.rotation().transpose();
  const Vec3 force_base = R_base_world * (state.acceleration_world_m_s2 + Vec3(0, 0, kGravity_m_s2)) +
                          dw.cross(arm) + w.cross(w.cross(arm));
  const Mat3 R_imu_base = T_base_imu.rotation().transpose();
  ImuSample sample;
  sample.angular_velocity_rad_s = R_imu_base * w;
  sample.specific_force_m_s2 = R_imu_base * force_base;
  sample.R_world_imu = state.T_world_base.rotation() * T_base_imu.rotation();
  return sample;
}

ImuErrors::ImuErrors(const ImuSensorParams& params, const ImuSensorEffects& effects, std::uint64_t seed)
    : params_(params), effects_(effects), rng_(seed, kStream) {
  gyro_bias_ = normal3(params.gyro_bias_rad_s);
  accel_bias_ = normal3(params.kAccelBias_m_s2);
  tilt_ = normal3(params.kTiltSigma_rad);
  yaw_rate_ = rng_.normal(0, params.kYawDrift_rad_s);
}

Vec3 ImuErrors::normal3(double sigma) {
  Vec3 v;
  for (int i = 0; i < 3; ++i) v[i] = rng_.normal(0, sigma);
  return v;
}

ImuSample ImuErrors::next(const ImuSample& exact) {
  const double step_s = 1 / params_.imu_rate_hz;
  const Vec3 gyro_noise = normal3(params_.kGyroDensity_rad_s_sqrt_hz / std::sqrt(step_s));
  const Vec3 accel_noise = normal3(params_.kAccelDensity_m_s2_sqrt_hz / std::sqrt(step_s));
  const double keep = std::exp(-step_s / kTiltCorrelation_s);
  const Vec3 tilt_noise = normal3(params_.kTiltSigma_rad * std::sqrt(1 - keep * keep));

  ImuSample sample = exact;
  if (effects_.imu_noise) {
    sample.angular_velocity_rad_s += gyro_noise;
    sample.specific_force_m_s2 += accel_noise;
  }
  if (effects_.imu_bias) {
    sample.angular_velocity_rad_s += gyro_bias_;
    sample.specific_force_m_s2 += accel_bias_;
  }
  if (!params_.imu_orientation) {
    sample.R_world_imu.reset();
  } else if (effects_.orientation_error) {
    const Mat3 R_seen_world = so3_exp({0, 0, yaw_}) * so3_exp({tilt_.x(), tilt_.y(), 0});
    sample.R_world_imu = R_seen_world * *exact.R_world_imu;
  }
  gyro_bias_ += normal3(params_.kGyroBiasWalk_rad_s2_sqrt_hz * std::sqrt(step_s));
  accel_bias_ += normal3(params_.kAccelBiasWalk_m_s3_sqrt_hz * std::sqrt(step_s));
  tilt_ = keep * tilt_ + tilt_noise;
  yaw_ += yaw_rate_ * step_s;
  return sample;
}

}  // namespace hm
