#include "hm/control/mixer.hpp"

#include <cmath>

namespace hm {

Mixer::Mixer(const QuadrotorModel& model)
    : torque_ratio_m_(model.torque_ratio_m),
      thrust_constant_n_s2_(model.thrust_constant_n_s2),
      least_n_(model.rotor_thrust_n(min_f(model.idle_speed_rad_s, model.max_speed_rad_s))),
      most_n_(model.rotor_thrust_n(model.max_speed_rad_s)) {
  const float arm = model.arm_m, part = arm * std::sqrt(0.5F);
  if (model.layout == RotorLayout::kPlus) {
    x_m_ = {arm, 0, -arm, 0};
    y_m_ = {0, arm, 0, -arm};
  } else {
    x_m_ = {part, -part, -part, part};
    y_m_ = {part, part, -part, -part};
  }
  spin_ = {1, -1, 1, -1};
  lever_m2_ = 2 * arm * arm;
}

float Mixer::rotor_speed_rad_s(float thrust_n) const {
  return thrust_n > 0 ? std::sqrt(thrust_n / thrust_constant_n_s2_) : 0;
}

MixerResult Mixer::result_of(const std::array<float, 4>& rotor_thrust_n) const {
  MixerResult result;
  result.rotor_thrust_n = rotor_thrust_n;
  for (std::size_t i = 0; i < 4; ++i) {
    result.thrust_n += rotor_thrust_n[i];
    result.torque_n_m += rotor_thrust_n[i] * Vec3f(y_m_[i], -x_m_[i], spin_[i] * torque_ratio_m_);
  }
  return result;
}

MixerResult Mixer::mix(const MixerDemand& demand) const {
  std::array<float, 4> tilt{};
  float lowest = 0, highest = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    tilt[i] = (demand.torque_n_m.x() * y_m_[i] - demand.torque_n_m.y() * x_m_[i]) / lever_m2_;
    lowest = min_f(lowest, tilt[i]);
    highest = max_f(highest, tilt[i]);
  }
  // Tilt: the largest share for which a thrust exists that keeps every rotor within its limits.
  const float ceiling = max_f(least_n_, min_f(most_n_, 0.25F * demand.max_thrust_n));
  float share = 1;
  if (highest - lowest > most_n_ - least_n_) share = (most_n_ - least_n_) / (highest - lowest);
  if (-lowest * share > ceiling - least_n_) share = (ceiling - least_n_) / -lowest;
  // Thrust: the nearest one that leaves room for this tilt.
  const float wanted = 0.25F * demand.thrust_n;
  const float mean = clamp_f(wanted, least_n_ - share * lowest, min_f(most_n_ - share * highest, ceiling));
  // Yaw: what room is left.
  const float yaw = demand.torque_n_m.z() / (4 * torque_ratio_m_);
  float yaw_share = 1;
  for (std::size_t i = 0; i < 4; ++i) {
    const float thrust = mean + share * tilt[i], part = spin_[i] * yaw;
    if (thrust + part > most_n_) yaw_share = min_f(yaw_share, max_f(0, most_n_ - thrust) / part);
    if (thrust + part < least_n_) yaw_share = min_f(yaw_share, max_f(0, thrust - least_n_) / -part);
  }
  std::array<float, 4> rotors{};
  for (std::size_t i = 0; i < 4; ++i)
    rotors[i] = clamp_f(mean + share * tilt[i] + yaw_share * (spin_[i] * yaw), least_n_, most_n_);
  MixerResult result = result_of(rotors);
  result.tilt_limited = share < 1;
  result.thrust_limited = mean != wanted;
  result.yaw_limited = yaw_share < 1;
  return result;
}

}  // namespace hm
