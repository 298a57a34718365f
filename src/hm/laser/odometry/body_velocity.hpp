#pragma once
#include "hm/geometry/se2.hpp"

namespace hm {

/// Planar velocity from poses: an alpha-beta filter (dissertation eqs 2.4-2.8) on rigid transforms with the
/// velocity in the body frame, so that motion on a circle is predicted exactly. Poses at a high rate say
/// little of the velocity, each: it is updated at intervals of at least `kInterval_s`.
class BodyVelocity {
 public:
  /// The noise of a pose, 1 cm, is then one of 0.1 m/s; no common rate of lasers is near a multiple of it.
  static constexpr double kInterval_s = 0.04;

  BodyVelocity(double alpha, double beta) : alpha_(alpha), beta_(beta) {}
  /// Restarts at this pose, at rest or with a velocity.
  void reset(const SE2& T_odom_base, const Vec3& velocity = Vec3::Zero());
  /// Adds a pose measured dt_s (> 0) after the last one.
  void update(const SE2& T_odom_base, double dt_s);
  /// Time since the last update, dt_s after the last pose.
  [[nodiscard]] double since_s(double dt_s) const { return since_s_ + dt_s; }
  /// Whether a pose dt_s after the last one updates the velocity.
  [[nodiscard]] bool is_due(double dt_s) const { return since_s(dt_s) >= kInterval_s; }
  /// Where the velocity leads from the pose of the last update, dt_s after the last pose.
  [[nodiscard]] SE2 predicted(double dt_s) const {
    return T_odom_updated_ * SE2::exp(velocity_ * since_s(dt_s));
  }
  /// Velocity vx, vy (m/s) and yaw rate (rad/s) in the body frame.
  [[nodiscard]] const Vec3& velocity() const { return velocity_; }

 private:
  double alpha_, beta_;
  SE2 T_odom_filtered_, T_odom_updated_;
  double since_s_ = 0;  // time of the last pose since the last update
  Vec3 velocity_ = Vec3::Zero();
};

}  // namespace hm
