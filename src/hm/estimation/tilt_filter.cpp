#include "hm/estimation/tilt_filter.hpp"

#include <cmath>

namespace hm {
namespace {

template <class Scalar>
Scalar at_most_one(Scalar share) {
  return share < 1 ? share : 1;
}

}  // namespace

template <class Scalar>
void BasicTiltFilter<Scalar>::update(const Vector3& angular_velocity_rad_s,
                                     const Vector3& specific_force_m_s2, Scalar dt_s) {
  const Scalar force_m_s2 = specific_force_m_s2.norm();
  const bool is_gravity =
      std::abs(force_m_s2 / kFilterGravity_m_s2<Scalar> - 1) <= params_.kGravityToleranceRatio;
  if (!ready_) {
    if (!is_gravity) return;
    R_world_body_ = shortest_turn(specific_force_m_s2, Vector3::UnitZ());
    ready_ = true;
    return;
  }
  running_s_ += dt_s;
  R_world_body_ = turned(R_world_body_, dt_s * angular_velocity_rad_s);
  if (!is_gravity) return;
  // Applies a small share of the shortest rotation from the measured to the estimated up direction.
  const Vector3 up_body = R_world_body_.conjugate() * Vector3::UnitZ();
  const Vector3 correction = (specific_force_m_s2 / force_m_s2).cross(up_body);
  const Scalar time_constant_s =
      running_s_ < params_.kStart_s ? params_.kStartTimeConstant_s : params_.time_constant_s;
  R_world_body_ = turned(R_world_body_, at_most_one(dt_s / time_constant_s) * correction);
}

template <class Scalar>
typename BasicAccelerationCompensator<Scalar>::Vector3 BasicAccelerationCompensator<Scalar>::update(
    const Vector3& specific_force_body_m_s2, const Vector3& velocity_world_m_s,
    const Quaternion& R_world_body, Scalar dt_s) {
  const Vector3 force_world_m_s2 = R_world_body * specific_force_body_m_s2;
  if (!ready_) {
    force_world_m_s2_ = force_world_m_s2;
    slow_velocity_m_s_ = velocity_world_m_s;
    ready_ = true;
  }
  const Scalar share = at_most_one(dt_s / time_constant_s_);
  force_world_m_s2_ += share * (force_world_m_s2 - force_world_m_s2_);
  // s / (1 + T s) of the velocity equals 1 / (1 + T s) of the acceleration.
  const Vector3 acceleration_m_s2 = (velocity_world_m_s - slow_velocity_m_s_) / time_constant_s_;
  slow_velocity_m_s_ += share * (velocity_world_m_s - slow_velocity_m_s_);
  return R_world_body.conjugate() * (force_world_m_s2_ - acceleration_m_s2);
}

template class BasicTiltFilter<double>;
template class BasicTiltFilter<float>;
template class BasicAccelerationCompensator<double>;
template class BasicAccelerationCompensator<float>;

}  // namespace hm
