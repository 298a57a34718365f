#include "hm/laser/odometry/body_velocity.hpp"

namespace hm {

void BodyVelocity::reset(const SE2& T_odom_base, const Vec3& velocity) {
  T_odom_filtered_ = T_odom_base;
  velocity_ = velocity;
}

void BodyVelocity::update(const SE2& T_odom_base, double dt_s) {
  const SE2 T_odom_predicted = T_odom_filtered_ * SE2::exp(velocity_ * dt_s);
  const Vec3 residual = (T_odom_predicted.inverse() * T_odom_base).log();
  T_odom_filtered_ = T_odom_predicted * SE2::exp(alpha_ * residual);
  velocity_ += beta_ / dt_s * residual;
}

}  // namespace hm
