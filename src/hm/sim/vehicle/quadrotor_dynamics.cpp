#include "hm/sim/vehicle/quadrotor_dynamics.hpp"

#include <algorithm>

#include "hm/sensors/imu.hpp"

namespace hm {
namespace {

/// Share of the thrust of hovering above which a built-in attitude loop has its full effect.
constexpr double kFullAuthority = 0.25;

QuadrotorState moved(const QuadrotorState& state, const QuadrotorRates& rates, double step_s) {
  QuadrotorState next = state;
  next.com_world_m += step_s * rates.velocity_world_m_s;
  next.com_velocity_world_m_s += step_s * rates.acceleration_world_m_s2;
  next.q_world_base.coeffs() += step_s * rates.q_dot;
  next.angular_velocity_base_rad_s += step_s * rates.angular_acceleration_base_rad_s2;
  next.rotor_speed_rad_s += step_s * rates.rotor_acceleration_rad_s2;
  return next;
}

void add(QuadrotorRates& sum, const QuadrotorRates& rates, double weight) {
  sum.velocity_world_m_s += weight * rates.velocity_world_m_s;
  sum.acceleration_world_m_s2 += weight * rates.acceleration_world_m_s2;
  sum.q_dot += weight * rates.q_dot;
  sum.angular_acceleration_base_rad_s2 += weight * rates.angular_acceleration_base_rad_s2;
  sum.rotor_acceleration_rad_s2 += weight * rates.rotor_acceleration_rad_s2;
}

Eigen::Index index_of(std::size_t rotor) { return static_cast<Eigen::Index>(rotor); }

}  // namespace

QuadrotorDynamics::QuadrotorDynamics(const VehicleParams& params, const Vec3& com_base_m)
    : params_(params),
      com_base_m_(com_base_m),
      inertia_(params.airframe.inertia_xy_kg_m2, params.airframe.inertia_xy_kg_m2,
               params.airframe.inertia_z_kg_m2),
      arms_(rotor_positions(params.airframe)) {
  for (Vec3& arm : arms_) arm -= com_base_m;
}

double QuadrotorDynamics::thrust_n(std::size_t rotor, const QuadrotorState& state, const Mat3& R_world_base,
                                   const QuadrotorInputs& inputs) const {
  const double speed = state.rotor_speed_rad_s[index_of(rotor)];
  const double nominal_n = params_.rotor.thrust_constant_n_s2 * speed * speed;
  const RotorSurfaces& surfaces = inputs.surfaces[rotor];
  double factor = inputs.thrust_factor[index_of(rotor)];
  if (surfaces.below || surfaces.above)
    factor *= surface_effect_factor(surfaces, state.com_world_m + R_world_base * arms_[rotor],
                                    R_world_base.col(2), params_.rotor.kRadius_m);
  return factor * nominal_n;
}

QuadrotorDynamics::Forces QuadrotorDynamics::forces(const QuadrotorState& state, const Mat3& R_world_base,
                                                    const QuadrotorInputs& inputs) const {
  const Vec3 airspeed =
      R_world_base.transpose() * (state.com_velocity_world_m_s - inputs.wind_world_m_s);  // base frame
  Forces sum;
  sum.force_base_n = -params_.airframe.body_drag_n_s2_m2 * airspeed.norm() * airspeed;
  sum.least_thrust_n = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < kRotors; ++i) {
    const double thrust = thrust_n(i, state, R_world_base, inputs);
    const Vec3 through_air = airspeed + state.angular_velocity_base_rad_s.cross(arms_[i]);
    const double drag = params_.rotor.kDragConstant_n_s2_m * state.rotor_speed_rad_s[index_of(i)];
    const Vec3 force(-drag * through_air.x(), -drag * through_air.y(), thrust);
    sum.force_base_n += force;
    sum.torque_base_nm += arms_[i].cross(force);
    sum.torque_base_nm.z() += rotor_reaction(i) * params_.rotor.torque_ratio_m * thrust;
    sum.least_thrust_n = std::min(sum.least_thrust_n, thrust);
  }
  return sum;
}

QuadrotorRates QuadrotorDynamics::rates(const QuadrotorState& state, const QuadrotorInputs& inputs) const {
  const Mat3 R = state.R_world_base();
  const Vec3& w = state.angular_velocity_base_rad_s;
  const Forces own = forces(state, R, inputs);
  const BodyWrench contact = inputs.contact ? inputs.contact(state) : BodyWrench{};
  const double mass = params_.airframe.mass_kg;

  QuadrotorRates rates;
  rates.velocity_world_m_s = state.com_velocity_world_m_s;
  rates.acceleration_world_m_s2 =
      (R * own.force_base_n + contact.force_world_n) / mass - Vec3(0, 0, kGravity_m_s2);
  rates.q_dot = 0.5 * (state.q_world_base * Eigen::Quaterniond(0, w.x(), w.y(), w.z())).coeffs();
  const Vec3 free = (own.torque_base_nm - w.cross(inertia_.cwiseProduct(w))).cwiseQuotient(inertia_);
  rates.angular_acceleration_base_rad_s2 = free;
  if (params_.inner_loop.inner_loop != InnerLoopKind::kMotors) {
    const double full_n = kFullAuthority * mass * kGravity_m_s2 / static_cast<double>(kRotors);
    const double authority = std::clamp(own.least_thrust_n / full_n, 0.0, 1.0);
    rates.angular_acceleration_base_rad_s2 =
        (1 - authority) * free +
        authority * inner_loop_acceleration(params_.inner_loop, inputs.attitude, R, w);
  }
  rates.angular_acceleration_base_rad_s2 += contact.torque_base_nm.cwiseQuotient(inertia_);
  for (Eigen::Index i = 0; i < index_of(kRotors); ++i) {
    const double behind = inputs.rotor_command_rad_s[i] - state.rotor_speed_rad_s[i];
    rates.rotor_acceleration_rad_s2[i] =
        behind / (behind > 0 ? params_.rotor.spin_up_s : params_.rotor.spin_down_s);
  }
  return rates;
}

QuadrotorState QuadrotorDynamics::advance(const QuadrotorState& state, const QuadrotorInputs& inputs,
                                          double step_s) const {
  const QuadrotorRates k1 = rates(state, inputs);
  const QuadrotorRates k2 = rates(moved(state, k1, step_s / 2), inputs);
  const QuadrotorRates k3 = rates(moved(state, k2, step_s / 2), inputs);
  const QuadrotorRates k4 = rates(moved(state, k3, step_s), inputs);
  QuadrotorRates mean;
  add(mean, k1, 1.0 / 6);
  add(mean, k2, 1.0 / 3);
  add(mean, k3, 1.0 / 3);
  add(mean, k4, 1.0 / 6);
  QuadrotorState next = moved(state, mean, step_s);
  next.q_world_base.normalize();
  return next;
}

FlightState QuadrotorDynamics::base_motion(const QuadrotorState& state, const QuadrotorRates& rates) const {
  const Mat3 R = state.R_world_base();
  const Vec3 &w = state.angular_velocity_base_rad_s, &dw = rates.angular_acceleration_base_rad_s2;
  FlightState motion;
  motion.T_world_base = SE3(R, state.com_world_m - R * com_base_m_);
  motion.velocity_world_m_s = state.com_velocity_world_m_s - R * w.cross(com_base_m_);
  motion.acceleration_world_m_s2 =
      rates.acceleration_world_m_s2 - R * (dw.cross(com_base_m_) + w.cross(w.cross(com_base_m_)));
  motion.angular_velocity_base_rad_s = w;
  motion.angular_acceleration_base_rad_s2 = dw;
  return motion;
}

QuadrotorState QuadrotorDynamics::at_rest(const SE3& T_world_base) const {
  QuadrotorState state;
  state.com_world_m = T_world_base * com_base_m_;
  state.q_world_base = T_world_base.quaternion();
  return state;
}

double QuadrotorDynamics::rotor_power_w(const QuadrotorState& state, const QuadrotorInputs& inputs) const {
  const Mat3 R = state.R_world_base();
  double power_w = 0;
  for (std::size_t i = 0; i < kRotors; ++i)
    power_w +=
        params_.rotor.torque_ratio_m * thrust_n(i, state, R, inputs) * state.rotor_speed_rad_s[index_of(i)];
  return power_w;
}

}  // namespace hm
