#pragma once
#include <array>
#include <functional>

#include "hm/sim/motion/flight.hpp"
#include "hm/sim/vehicle/inner_loop.hpp"
#include "hm/sim/vehicle/rotors.hpp"

namespace hm {

/// State of a quadrotor: motion of its centre of mass, attitude, and rotor speeds.
struct QuadrotorState {
  Vec3 com_world_m = Vec3::Zero();
  Vec3 com_velocity_world_m_s = Vec3::Zero();
  Eigen::Quaterniond q_world_base = Eigen::Quaterniond::Identity();
  Vec3 angular_velocity_base_rad_s = Vec3::Zero();
  RotorValues rotor_speed_rad_s = RotorValues::Zero();

  [[nodiscard]] Mat3 R_world_base() const { return q_world_base.normalized().toRotationMatrix(); }
};

/// Time derivative of a QuadrotorState, in the same order.
struct QuadrotorRates {
  Vec3 velocity_world_m_s = Vec3::Zero();
  Vec3 acceleration_world_m_s2 = Vec3::Zero();
  Eigen::Vector4d q_dot = Eigen::Vector4d::Zero();  ///< x, y, z, w
  Vec3 angular_acceleration_base_rad_s2 = Vec3::Zero();
  RotorValues rotor_acceleration_rad_s2 = RotorValues::Zero();
};

/// Force and torque on a body: force in the world frame, torque about the centre of mass in the base frame.
struct BodyWrench {
  Vec3 force_world_n = Vec3::Zero();
  Vec3 torque_base_nm = Vec3::Zero();
};

/// Inputs of a quadrotor, constant during a step.
struct QuadrotorInputs {
  RotorValues rotor_command_rad_s = RotorValues::Zero();  ///< within what the battery allows
  RotorValues thrust_factor = RotorValues::Ones();        ///< 1 + error of each rotor
  Vec3 wind_world_m_s = Vec3::Zero();
  std::array<RotorSurfaces, kRotors> surfaces;
  InnerLoopCommand attitude;  ///< unused with InnerLoopKind::kMotors
  /// Forces of contact at a state; empty: none.
  std::function<BodyWrench(const QuadrotorState&)> contact;
};

/// Equations of motion of a quadrotor (Newton, Euler):
///   m dv = -m g z + R sum(F_i) - c2 |u| u + F_contact,      u = v - wind,
///   J dw = sum(r_i x F_i + M_i) - w x J w + M_contact,
///   F_i = T_i z - cd W_i u_perp_i,   M_i = +-kM T_i z,   T_i = kT W_i^2 (1 + e_i) g(surfaces),
///   dW_i = (W_cmd_i - W_i) / tau, with one tau for rising and one for falling speeds,
/// where u_perp_i is the rotor's velocity through the air across its axis. With a built-in attitude loop,
/// this loop determines dw instead, as far as all rotors turn: fully from a quarter of the thrust of
/// hovering on each, not at all with a rotor at rest.
class QuadrotorDynamics {
 public:
  /// `com_base_m`: the centre of mass in the base frame.
  QuadrotorDynamics(const VehicleParams& params, const Vec3& com_base_m);

  [[nodiscard]] QuadrotorRates rates(const QuadrotorState& state, const QuadrotorInputs& inputs) const;
  /// State after a step of the classical Runge-Kutta method of fourth order; the quaternion has unit length.
  [[nodiscard]] QuadrotorState advance(const QuadrotorState& state, const QuadrotorInputs& inputs,
                                       double step_s) const;
  /// Motion of the base's origin.
  [[nodiscard]] FlightState base_motion(const QuadrotorState& state, const QuadrotorRates& rates) const;
  /// State with this pose of the base, at rest, rotors at rest.
  [[nodiscard]] QuadrotorState at_rest(const SE3& T_world_base) const;
  /// Mechanical power of the rotors, sum(kM T W), watt.
  [[nodiscard]] double rotor_power_w(const QuadrotorState& state, const QuadrotorInputs& inputs) const;
  [[nodiscard]] const Vec3& com_base_m() const { return com_base_m_; }

 private:
  /// Forces of the rotors and the drag of the body, without the weight.
  struct Forces {
    Vec3 force_base_n = Vec3::Zero(), torque_base_nm = Vec3::Zero();
    double least_thrust_n = 0;  ///< of a rotor
  };
  [[nodiscard]] Forces forces(const QuadrotorState& state, const Mat3& R_world_base,
                              const QuadrotorInputs& inputs) const;
  [[nodiscard]] double thrust_n(std::size_t rotor, const QuadrotorState& state, const Mat3& R_world_base,
                                const QuadrotorInputs& inputs) const;

  VehicleParams params_;
  Vec3 com_base_m_, inertia_;
  std::array<Vec3, kRotors> arms_;  ///< of the rotors, from the centre of mass
};

}  // namespace hm
