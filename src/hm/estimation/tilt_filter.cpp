#include "hm/estimation/tilt_filter.hpp"

#include <algorithm>
#include <cmath>

#include "hm/estimation/alpha_beta.hpp"
#include "hm/geometry/solvers/small_solvers.hpp"
#include "hm/sensors/imu.hpp"

namespace hm {

void TiltFilter::update(const Vec3& angular_velocity_rad_s, const Vec3& specific_force_m_s2, double dt_s) {
  const double force_m_s2 = specific_force_m_s2.norm();
  const bool is_gravity = std::abs(force_m_s2 / kGravity_m_s2 - 1) <= params_.kGravityToleranceRatio;
  if (!ready_) {
    if (!is_gravity) return;
    R_world_body_ = turn_between(specific_force_m_s2, Vec3::UnitZ());
    ready_ = true;
    return;
  }
  running_s_ += dt_s;
  R_world_body_ = turned(R_world_body_, dt_s * angular_velocity_rad_s);
  if (!is_gravity) return;
  // Applies a small share of the shortest rotation from the measured to the estimated up direction.
  const Vec3 up_body = R_world_body_.conjugate() * Vec3::UnitZ();
  const Vec3 correction = (specific_force_m_s2 / force_m_s2).cross(up_body);
  const double time_constant_s =
      running_s_ < params_.start_s ? params_.kStartTimeConstant_s : params_.time_constant_s;
  R_world_body_ = turned(R_world_body_, std::min(dt_s / time_constant_s, 1.0) * correction);
}

Vec3 AccelerationCompensator::update(const Vec3& specific_force_body_m_s2, const Vec3& velocity_world_m_s,
                                     const Eigen::Quaterniond& R_world_body, double dt_s) {
  const Vec3 force_world_m_s2 = R_world_body * specific_force_body_m_s2;
  if (!ready_) {
    force_world_m_s2_ = force_world_m_s2;
    slow_velocity_m_s_ = velocity_world_m_s;
    ready_ = true;
  }
  const double share = std::min(dt_s / time_constant_s_, 1.0);
  force_world_m_s2_ += share * (force_world_m_s2 - force_world_m_s2_);
  // s / (1 + T s) of the velocity equals 1 / (1 + T s) of the acceleration.
  const Vec3 acceleration_m_s2 = (velocity_world_m_s - slow_velocity_m_s_) / time_constant_s_;
  slow_velocity_m_s_ += share * (velocity_world_m_s - slow_velocity_m_s_);
  return R_world_body.conjugate() * (force_world_m_s2_ - acceleration_m_s2);
}

}  // namespace hm
