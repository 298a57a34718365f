#include "hm/sim/vehicle/vehicle_imu.hpp"

#include <cmath>
#include <numbers>

#include "hm/core/check.hpp"

namespace hm {
namespace {

constexpr double kImuStep_s = 1e-3;
constexpr std::uint64_t kVibrationStream = 0x766962, kMisalignmentStream = 0x6d6973;

Vec3 random_direction(Rng& rng) {
  Vec3 v;
  for (double& x : v) x = rng.normal();
  return v.normalized();
}

SE3 misaligned(const VehicleImuSetup& setup) {
  Rng rng(setup.seed, kMisalignmentStream);
  const Vec3 turn = setup.vibration.imu_misalignment_rad * random_direction(rng);
  return setup.T_base_imu * SE3(so3_exp(turn), Vec3::Zero());
}

}  // namespace

ImuLowPass::ImuLowPass(double cut_off_hz) {
  HM_CHECK(cut_off_hz > 0 && cut_off_hz < 0.5 / kImuStep_s, "{} Hz", cut_off_hz);
  const double k = std::tan(std::numbers::pi * cut_off_hz * kImuStep_s);
  const double norm = 1 / (1 + std::numbers::sqrt2 * k + k * k);
  b0_ = k * k * norm;
  a1_ = 2 * (k * k - 1) * norm;
  a2_ = (1 - std::numbers::sqrt2 * k + k * k) * norm;
}

Vec6 ImuLowPass::filter(const Vec6& input) {
  if (!in_1_) in_1_ = in_2_ = out_1_ = out_2_ = input;
  const Vec6 output = b0_ * (input + 2 * *in_1_ + in_2_) - a1_ * out_1_ - a2_ * out_2_;
  in_2_ = *in_1_;
  in_1_ = input;
  out_2_ = out_1_;
  out_1_ = output;
  return output;
}

RotorVibration::RotorVibration(const VibrationParams& params, double hover_speed_rad_s, std::uint64_t seed)
    : hover_speed_rad_s_(hover_speed_rad_s) {
  Rng rng(seed, kVibrationStream);
  for (auto& rotor : lines_)
    for (Line& line : rotor) {
      line.amplitude.head<3>() = params.vibration_rad_s * random_direction(rng);
      line.amplitude.tail<3>() = params.vibration_m_s2 * random_direction(rng);
      line.phase_rad = rng.uniform(0, 2 * std::numbers::pi);
    }
}

Vec6 RotorVibration::next(const RotorValues& rotor_speed_rad_s, double step_s) {
  Vec6 sum = Vec6::Zero();
  for (std::size_t i = 0; i < kRotors; ++i) {
    const double speed = rotor_speed_rad_s[static_cast<Eigen::Index>(i)];
    angle_rad_[i] = std::fmod(angle_rad_[i] + speed * step_s, 2 * std::numbers::pi);
    const double scale = (speed / hover_speed_rad_s_) * (speed / hover_speed_rad_s_);
    for (std::size_t k = 0; k < kLines; ++k) {
      const Line& line = lines_[i][k];
      sum += scale * std::sin(static_cast<double>(k + 1) * angle_rad_[i] + line.phase_rad) * line.amplitude;
    }
  }
  return sum;
}

VehicleImu::VehicleImu(const VehicleImuSetup& setup)
    : T_base_imu_(misaligned(setup)),
      vibration_(setup.vibration, setup.hover_speed_rad_s, setup.seed),
      low_pass_(setup.vibration.imu_filter_hz),
      errors_(setup.sensor, setup.effects, setup.seed),
      steps_per_sample_(static_cast<int>(std::lround(1 / (setup.sensor.imu_rate_hz * kImuStep_s)))) {
  HM_CHECK(std::abs(steps_per_sample_ * setup.sensor.imu_rate_hz * kImuStep_s - 1) < 1e-9,
           "an IMU rate of {} Hz does not divide 1000", setup.sensor.imu_rate_hz);
}

std::optional<ImuSample> VehicleImu::step(Time now, const FlightState& motion,
                                          const RotorValues& rotor_speed_rad_s) {
  ImuSample sample = exact_imu(motion, T_base_imu_);
  Vec6 felt;
  felt << sample.angular_velocity_rad_s, sample.specific_force_m_s2;
  felt = low_pass_.filter(felt + vibration_.next(rotor_speed_rad_s, kImuStep_s));
  if (++step_ % steps_per_sample_ != 0) return std::nullopt;
  sample.stamp = now;
  sample.angular_velocity_rad_s = felt.head<3>();
  sample.specific_force_m_s2 = felt.tail<3>();
  return errors_.next(sample);
}

}  // namespace hm
