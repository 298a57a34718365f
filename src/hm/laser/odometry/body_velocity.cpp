#include "hm/laser/odometry/body_velocity.hpp"

namespace hm {

void BodyVelocity::reset(const SE2& T_odom_base, const Vec3& velocity) {
  T_odom_filtered_ = T_odom_updated_ = T_odom_base;
  velocity_ = velocity;
  since_s_ = 0;
}

void BodyVelocity::update(const SE2& T_odom_base, double dt_s) {
  since_s_ += dt_s;
  if (!is_due(0)) return;
  const SE2 T_odom_predicted = T_odom_filtered_ * SE2::exp(velocity_ * since_s_);
  const Vec3 residual = (T_odom_predicted.inverse() * T_odom_base).log();
  T_odom_filtered_ = T_odom_predicted * SE2::exp(alpha_ * residual);
  velocity_ += beta_ / since_s_ * residual;
  T_odom_updated_ = T_odom_base;
  since_s_ = 0;
}

}  // namespace hm
