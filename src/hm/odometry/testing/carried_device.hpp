#pragma once
#include <cmath>
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/core/testing/drawn_vector.hpp"
#include "hm/sensors/imu.hpp"

namespace hm {

/// A smooth path of a hand-held camera in a world whose z axis points up, with its derivatives.
struct CarriedPath {
  static SE3 pose(double t_s) {
    const Vec3 p(1.2 * std::sin(0.7 * t_s), 0.9 * std::cos(0.5 * t_s), 0.1 * std::sin(2.1 * t_s));
    return {so3_exp(Vec3(0, 0, 0.8 * std::sin(0.6 * t_s))) *
                so3_exp(Vec3(-1.5 + 0.3 * std::sin(0.9 * t_s), 0.2 * std::cos(1.3 * t_s), 0)),
            p};
  }
  static Vec3 velocity_m_s(double t_s) {
    return {0.84 * std::cos(0.7 * t_s), -0.45 * std::sin(0.5 * t_s), 0.21 * std::cos(2.1 * t_s)};
  }
  static Vec3 acceleration_m_s2(double t_s) {
    return {-0.588 * std::sin(0.7 * t_s), -0.225 * std::cos(0.5 * t_s), -0.441 * std::sin(2.1 * t_s)};
  }
  static Vec3 turn_rad_s(double t_s) {
    constexpr double kHalf_s = 1e-4;
    return so3_log(pose(t_s - kHalf_s).rotation().transpose() * pose(t_s + kHalf_s).rotation()) /
           (2 * kHalf_s);
  }
  static Vec3 force_m_s2(double t_s) {
    return pose(t_s).rotation().transpose() * (acceleration_m_s2(t_s) + Vec3(0, 0, kGravity_m_s2));
  }
};

/// Errors of the device that is carried along.
struct CarriedErrors {
  Vec3 gyro_bias_rad_s = Vec3::Zero(), accel_bias_m_s2 = Vec3::Zero();
  double gyro_density = 0, accel_density = 0;  ///< white noise, per root of a hertz
  double delay_s = 0;                          ///< of the stamps
};

inline std::vector<ImuSample> carried_readings(double begin_s, double end_s, double rate_hz,
                                               const CarriedErrors& errors, Rng* rng = nullptr) {
  std::vector<ImuSample> readings;
  const auto noise = [&](double density) -> Vec3 {
    if (rng == nullptr || !(density > 0)) return Vec3::Zero();
    return density * std::sqrt(rate_hz) * test::drawn<3>([&] { return rng->normal(0, 1); });
  };
  for (int i = 0; begin_s + i / rate_hz <= end_s + 1e-9; ++i) {
    const double t_s = begin_s + i / rate_hz;
    ImuSample reading;
    reading.stamp = Time::from_seconds(t_s + errors.delay_s);
    reading.angular_velocity_rad_s =
        CarriedPath::turn_rad_s(t_s) + errors.gyro_bias_rad_s + noise(errors.gyro_density);
    reading.specific_force_m_s2 =
        CarriedPath::force_m_s2(t_s) + errors.accel_bias_m_s2 + noise(errors.accel_density);
    readings.push_back(reading);
  }
  return readings;
}

}  // namespace hm
