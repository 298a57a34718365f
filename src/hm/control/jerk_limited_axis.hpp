#pragma once

namespace hm {

/// Limits of a motion along one axis, all positive. Units of the axis: metres, or radians for yaw.
struct AxisLimits {
  float speed_up = 1.5F;    ///< in the positive direction, per second
  float speed_down = 1.5F;  ///< in the negative direction
  float acceleration = 2.5F;
  float jerk = 8;
};

/// Motion of a set-point along one axis: changes its acceleration by at most `jerk` per second, keeps within
/// acceleration and speed, and reaches its goal at rest, near the least time. It can start from any state;
/// what exceeds the limits then (speed, acceleration) is brought back within them at the jerk limit.
///
/// Each step takes the largest jerk towards the goal after which braking at the limits still stops at the
/// goal; so a goal is not passed unless it is set nearer than the stopping distance, or the limits shrink on
/// the way.
class JerkLimitedAxis {
 public:
  /// State: distance to the goal (goal minus position), velocity, acceleration.
  struct State {
    float to_go = 0, velocity = 0, acceleration = 0;
  };
  void start_from(const State& state) { state_ = state; }
  void move_goal_by(float difference) { state_.to_go += difference; }
  void stand_at_goal() { state_.to_go = 0; }
  void step_to_goal(const AxisLimits& limits, float step_s);
  /// Towards a velocity, which is clamped to the limits; the distance to go changes as the axis moves.
  void step_to_velocity(float target, const AxisLimits& limits, float step_s);
  [[nodiscard]] const State& state() const { return state_; }

 private:
  State state_;
};

/// Signed distance covered while coming to rest at the limits.
[[nodiscard]] float stopping_distance(float velocity, float acceleration, const AxisLimits& limits);
/// Velocity that remains when the acceleration is taken to zero at the jerk limit.
[[nodiscard]] float settled_velocity(float velocity, float acceleration, float jerk);

}  // namespace hm
