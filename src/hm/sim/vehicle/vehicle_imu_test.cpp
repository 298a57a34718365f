#include "hm/sim/vehicle/vehicle_imu.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

namespace hm {
namespace {

constexpr double kStep_s = 1e-3;

VehicleImuSetup ideal() {
  VehicleImuSetup setup;
  setup.sensor.imu_rate_hz = 1000;
  setup.effects = {false, false, false};
  setup.vibration.vibration_m_s2 = setup.vibration.vibration_rad_s = 0;
  setup.vibration.imu_misalignment_rad = 0;
  return setup;
}

/// Complex amplitudes of six channels at a frequency, over a second from the third second on.
template <class Signal>
Eigen::Matrix<std::complex<double>, 6, 1> spectrum(double frequency_hz, const Signal& next) {
  Eigen::Matrix<std::complex<double>, 6, 1> sum = decltype(sum)::Zero();
  for (int i = 0; i < 3000; ++i) {
    const Vec6 value = next(i);
    if (i >= 2000)
      sum += value.cast<std::complex<double>>() *
             std::polar(2.0 / 1000, -2 * std::numbers::pi * frequency_hz * i * kStep_s);
  }
  return sum;
}

TEST(ImuLowPass, HasTheGainOfAButterworthFilter) {
  constexpr double kCut_hz = 188;
  for (const double frequency : {20.0, 93.0, 188.0, 400.0}) {
    ImuLowPass filter(kCut_hz);
    const auto out = spectrum(frequency, [&](int i) {
      return filter.filter(Vec6::Constant(std::sin(2 * std::numbers::pi * frequency * i * kStep_s)));
    });
    const double ratio =
        std::tan(std::numbers::pi * frequency * kStep_s) / std::tan(std::numbers::pi * kCut_hz * kStep_s);
    EXPECT_NEAR(std::abs(out[3]), 1 / std::sqrt(1 + std::pow(ratio, 4)), 1e-6) << frequency;
  }
  ImuLowPass filter(kCut_hz);
  const Vec6 constant = Vec6::LinSpaced(1, 6);
  for (int i = 0; i < 5; ++i) EXPECT_LT((filter.filter(constant) - constant).norm(), 1e-12);
}

TEST(RotorVibration, IsALineAtTheRotorsFrequencyAndItsDouble) {
  const VibrationParams params;
  constexpr double kFrequency_hz = 90, kSpeed = 2 * std::numbers::pi * kFrequency_hz;
  for (const double share : {1.0, 0.5}) {
    const auto amplitude = [&](double frequency_hz) {
      RotorVibration vibration(params, kSpeed, 5);
      RotorValues speeds = RotorValues::Zero();
      speeds[2] = share * kSpeed;
      const auto out = spectrum(frequency_hz, [&](int) { return vibration.next(speeds, kStep_s); });
      return std::pair{out.head<3>().norm(), out.tail<3>().norm()};
    };
    for (const double harmonic : {1, 2}) {
      const auto [rate, force] = amplitude(harmonic * share * kFrequency_hz);
      EXPECT_NEAR(rate, 0.03 * share * share, 1e-6);
      EXPECT_NEAR(force, 1.5 * share * share, 1e-6);
    }
    EXPECT_NEAR(amplitude(3 * share * kFrequency_hz).second, 0, 1e-6);
  }
}

TEST(VehicleImu, IsMisalignedByOneDegree) {
  VehicleImuSetup setup = ideal();
  setup.vibration.imu_misalignment_rad = VibrationParams{}.imu_misalignment_rad;
  setup.T_base_imu = SE3(so3_exp({0, 0, std::numbers::pi / 2}), Vec3(0.1, 0, 0));
  VehicleImu imu(setup);
  EXPECT_NEAR((setup.T_base_imu.inverse() * imu.T_base_imu()).angle(), std::numbers::pi / 180, 1e-6);
  FlightState spinning;
  spinning.angular_velocity_base_rad_s = Vec3(0, 0, 2);
  const auto sample = imu.step(Time{7}, spinning, RotorValues::Zero());
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->stamp, Time{7});
  const Mat3 R = imu.T_base_imu().rotation().transpose();
  EXPECT_LT((sample->angular_velocity_rad_s - R * Vec3(0, 0, 2)).norm(), 1e-12);
  const Vec3 felt = Vec3(-0.1 * 2 * 2, 0, kGravity_m_s2);  // centripetal, and gravity
  EXPECT_LT((sample->specific_force_m_s2 - R * felt).norm(), 1e-12);
}

TEST(VehicleImu, SamplesAtItsRateWithItsNoiseDensity) {
  VehicleImuSetup setup = ideal();
  setup.effects.imu_noise = true;
  for (const double rate_hz : {1000.0, 250.0}) {
    setup.sensor.imu_rate_hz = rate_hz;
    VehicleImu imu(setup);
    int samples = 0;
    double square = 0;
    for (int i = 1; i <= 40'000; ++i) {
      const auto sample = imu.step(Time{i}, {}, RotorValues::Zero());
      if (!sample) continue;
      ++samples;
      square += sample->angular_velocity_rad_s.squaredNorm() / 3;
    }
    EXPECT_EQ(samples, static_cast<int>(40 * rate_hz));
    const double sigma = ImuSensorParams::kGyroDensity_rad_s_sqrt_hz * std::sqrt(rate_hz);
    EXPECT_NEAR(std::sqrt(square / samples), sigma, 0.03 * sigma);
  }
}

TEST(VehicleImu, VibrationPassesTheFilterBeforeSampling) {
  VehicleImuSetup setup = ideal();
  setup.vibration.vibration_m_s2 = 1.5;
  setup.vibration.imu_filter_hz = 30;
  constexpr double kFrequency_hz = 90;
  setup.hover_speed_rad_s = 2 * std::numbers::pi * kFrequency_hz;
  VehicleImu imu(setup);
  RotorValues speeds = RotorValues::Zero();
  speeds[0] = setup.hover_speed_rad_s;
  const auto out = spectrum(kFrequency_hz, [&](int i) {
    Vec6 felt;
    const auto sample = imu.step(Time{i}, {}, speeds);
    felt << sample->angular_velocity_rad_s, sample->specific_force_m_s2;
    return felt;
  });
  const double ratio =
      std::tan(std::numbers::pi * kFrequency_hz * kStep_s) / std::tan(std::numbers::pi * 30 * kStep_s);
  EXPECT_NEAR(out.tail<3>().norm(), 1.5 / std::sqrt(1 + std::pow(ratio, 4)), 1e-6);
}

}  // namespace
}  // namespace hm
