#pragma once
#include "hm/geometry/se2.hpp"

namespace hm {

/// Planar velocity from poses: an alpha-beta filter (dissertation eqs 2.4-2.8) on rigid transforms with the
/// velocity in the body frame, so that motion on a circle is predicted exactly.
class BodyVelocity {
 public:
  BodyVelocity(double alpha, double beta) : alpha_(alpha), beta_(beta) {}
  /// Restarts at this pose, at rest or with a velocity.
  void reset(const SE2& T_odom_base, const Vec3& velocity = Vec3::Zero());
  /// Updates with a pose measured dt_s (> 0) after the last one.
  void update(const SE2& T_odom_base, double dt_s);
  /// Velocity vx, vy (m/s) and yaw rate (rad/s) in the body frame.
  [[nodiscard]] const Vec3& velocity() const { return velocity_; }

 private:
  double alpha_, beta_;
  SE2 T_odom_filtered_;
  Vec3 velocity_ = Vec3::Zero();
};

}  // namespace hm
