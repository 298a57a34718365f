#include "hm/control/hover_thrust.hpp"

#include <cmath>

#include "hm/geometry/float/float_math.hpp"

namespace hm {
namespace {
/// Samples that differ by more standard deviations are ignored.
constexpr float kGateSigma = 4;
/// Noise of one sample of the accelerometer, with vibration.
constexpr float kAccelerometerStd_m_s2 = 2;
/// Standard deviation of the hover thrust at take-off, per thrust: battery and load are not known.
constexpr float kInitialStdRatio = 0.15F;
/// Below this share of the nominal weight the rotors are not what carries the vehicle.
constexpr float kLeastThrustRatio = 0.3F;
/// Refused samples for so long show that the estimate is wrong.
constexpr float kRefusedTime_s = 1;
}  // namespace

HoverThrust::HoverThrust(const HoverThrustParams& params, const QuadrotorModel& model, float step_s)
    : params_(params),
      nominal_(1 / model.mass_kg),
      step_s_(step_s),
      lag_share_(step_s / (step_s + model.motor_s)),
      least_thrust_n_(kLeastThrustRatio * model.mass_kg * kGravityF_m_s2) {
  reset();
}

void HoverThrust::reset() {
  force_per_newton_ = nominal_;
  const float deviation = kInitialStdRatio * nominal_;
  variance_ = deviation * deviation;
  lagged_thrust_n_ = 0;
  refused_s_ = 0;
}

void HoverThrust::step(float commanded_thrust_n, float specific_force_z_m_s2) {
  lag(commanded_thrust_n);
  const float walk = params_.walk_ratio_sqrt_s * nominal_;
  const float initial = kInitialStdRatio * nominal_;
  variance_ = min_f(variance_ + walk * walk * step_s_, initial * initial);
  if (lagged_thrust_n_ < least_thrust_n_ || !std::isfinite(specific_force_z_m_s2)) return;
  const float noise = kAccelerometerStd_m_s2 * kAccelerometerStd_m_s2;
  const float residual = specific_force_z_m_s2 - force_per_newton_ * lagged_thrust_n_;
  const float spread = lagged_thrust_n_ * lagged_thrust_n_ * variance_ + noise;
  if (residual * residual > kGateSigma * kGateSigma * spread) {
    refused_s_ += step_s_;
    if (refused_s_ > kRefusedTime_s) {
      variance_ = initial * initial;
      refused_s_ = 0;
    }
    return;
  }
  refused_s_ = 0;
  const float gain = variance_ * lagged_thrust_n_ / spread;
  force_per_newton_ = clamp_f(force_per_newton_ + gain * residual, 0.5F * nominal_, 2 * nominal_);
  variance_ -= gain * lagged_thrust_n_ * variance_;
}

float HoverThrust::hover_thrust_n() const { return kGravityF_m_s2 / force_per_newton_; }

}  // namespace hm
