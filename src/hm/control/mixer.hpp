#pragma once
#include <array>
#include <limits>

#include "hm/control/quadrotor_model.hpp"
#include "hm/geometry/float/float_math.hpp"

namespace hm {

struct MixerDemand {
  float thrust_n = 0;                ///< of all rotors together
  Vec3f torque_n_m = Vec3f::Zero();  ///< in the base frame
  /// No priority raises the thrust above this, whatever the torques ask for (landing, motors starting).
  float max_thrust_n = std::numeric_limits<float>::infinity();
};

struct MixerResult {
  std::array<float, 4> rotor_thrust_n{};
  float thrust_n = 0;  ///< sum of the rotors
  Vec3f torque_n_m = Vec3f::Zero();
  bool tilt_limited = false, thrust_limited = false, yaw_limited = false;
};

/// Distributes thrust and torques to four rotors, each between idle and full thrust. What does not fit is
/// given up in this order: yaw torque, then thrust (up or down, by as little as the tilt torques need), then
/// the tilt torques, both by the same share so that their direction stays.
class Mixer {
 public:
  explicit Mixer(const QuadrotorModel& model);
  /// The demand must be numbers.
  [[nodiscard]] MixerResult mix(const MixerDemand& demand) const;
  /// Speed of a rotor that gives this thrust.
  [[nodiscard]] float rotor_speed_rad_s(float thrust_n) const;
  /// Total thrust and torques of rotors with these thrusts.
  [[nodiscard]] MixerResult result_of(const std::array<float, 4>& rotor_thrust_n) const;
  [[nodiscard]] float min_rotor_thrust_n() const { return least_n_; }
  [[nodiscard]] float max_rotor_thrust_n() const { return most_n_; }

 private:
  std::array<float, 4> x_m_{}, y_m_{}, spin_{};  // spin: sign of the torque about z
  float lever_m2_ = 1;                           // sum of the squared x (or y) of the rotors
  float torque_ratio_m_, thrust_constant_n_s2_, least_n_, most_n_;
};

}  // namespace hm
