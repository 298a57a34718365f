#pragma once
#include "hm/control/quadrotor_model.hpp"

namespace hm {

struct HoverThrustParams {
  float walk_ratio_sqrt_s = 0.0065F;  ///< change of the hover thrust in a second (battery, load), per thrust
};

/// Commanded thrust that carries the vehicle, estimated while it flies by a Kalman filter of one state: the
/// specific force along the vehicle's z axis per commanded newton (1 over the mass when thrust is as
/// modelled). The commanded thrust reaches the measurement through the rotors' time constant.
class HoverThrust {
 public:
  HoverThrust(const HoverThrustParams& params, const QuadrotorModel& model, float step_s);
  void reset();
  /// One step in the air. Nothing is learned from less than 30 % of the nominal hover thrust, or from a
  /// sample that is no number or outside the gate (1 s of them widens the gate: the estimate may be what is
  /// wrong).
  void step(float commanded_thrust_n, float specific_force_z_m_s2);
  /// Sets the thrust that the rotors have, without learning: on the ground, or when something else flies.
  void follow(float commanded_thrust_n) { lagged_thrust_n_ = commanded_thrust_n; }
  /// One step without learning: the rotors follow the command.
  void lag(float commanded_thrust_n) {
    lagged_thrust_n_ += lag_share_ * (commanded_thrust_n - lagged_thrust_n_);
  }
  /// Thrust that the rotors have by now.
  [[nodiscard]] float lagged_thrust_n() const { return lagged_thrust_n_; }
  /// In newtons of commanded thrust; within a half and twice the nominal weight.
  [[nodiscard]] float hover_thrust_n() const;
  [[nodiscard]] float variance() const { return variance_; }  ///< of the specific force per newton

 private:
  HoverThrustParams params_;
  float nominal_, step_s_, lag_share_, least_thrust_n_;
  float force_per_newton_ = 0, variance_ = 0, lagged_thrust_n_ = 0, refused_s_ = 0;
};

}  // namespace hm
