#include "hm/control/jerk_limited_axis.hpp"

#include <cmath>

#include "hm/geometry/float/float_math.hpp"

namespace hm {
namespace {

using AxisState = JerkLimitedAxis::State;

/// Nearer than this the goal counts as reached: rounding of the stopping distance.
constexpr float kReachedDistance = 5e-5F, kReachedVelocity = 2e-4F;

AxisState advanced(const AxisState& s, float jerk, float step_s) {
  const float half = 0.5F * step_s;
  return {s.to_go - step_s * (s.velocity + half * (s.acceleration + step_s * (1.0F / 3) * jerk)),
          s.velocity + step_s * (s.acceleration + half * jerk), s.acceleration + step_s * jerk};
}

AxisState mirrored(const AxisState& s, bool mirror) {
  return mirror ? AxisState{-s.to_go, -s.velocity, -s.acceleration} : s;
}

struct JerkRange {
  float least, most;
};

/// Jerks that keep the acceleration within its limit, or bring it back.
JerkRange allowed_jerks(float acceleration, const AxisLimits& limits, float step_s) {
  const float most = (limits.acceleration - acceleration) / step_s;
  const float least = (-limits.acceleration - acceleration) / step_s;
  return {clamp_f(least, -limits.jerk, limits.jerk), clamp_f(most, -limits.jerk, limits.jerk)};
}

/// Largest jerk for which `margin`, nearly linear in the jerk over one step, is not negative.
template <class Margin>
float largest_jerk(const JerkRange& range, const Margin& margin) {
  const float at_most = margin(range.most);
  if (at_most >= 0) return range.most;
  const float at_least = margin(range.least);
  if (at_least <= 0) return range.least;
  return range.least + (range.most - range.least) * (at_least / (at_least - at_most));
}

}  // namespace

float settled_velocity(float velocity, float acceleration, float jerk) {
  return velocity + acceleration * std::abs(acceleration) / (2 * jerk);
}

float stopping_distance(float velocity, float acceleration, const AxisLimits& limits) {
  const float jerk = limits.jerk;
  if (settled_velocity(velocity, acceleration, jerk) < 0)
    return -stopping_distance(-velocity, -acceleration, limits);
  // Down to the acceleration -peak, held for a while, then up to zero.
  const float v = velocity, a = acceleration;
  const float free_peak = std::sqrt(max_f(0, jerk * v + 0.5F * a * a));
  const float peak = min_f(free_peak, max_f(limits.acceleration, -a));
  const float t1 = (a + peak) / jerk;
  const float v1 = v + t1 * (a - 0.5F * jerk * t1);
  const float covered = t1 * (v + t1 * (0.5F * a - jerk * t1 * (1.0F / 6)));
  const float v2 = peak * peak / (2 * jerk);
  const float held = peak > 0 ? max_f(0, v1 - v2) / peak : 0;
  return covered + held * 0.5F * (v1 + v2) + peak * v2 / (3 * jerk);
}

void JerkLimitedAxis::step_to_goal(const AxisLimits& limits, float step_s) {
  const float small_acceleration = limits.jerk * step_s;
  if (std::abs(state_.to_go) <= kReachedDistance && std::abs(state_.velocity) <= kReachedVelocity &&
      std::abs(state_.acceleration) <= small_acceleration) {
    state_ = {};
    return;
  }
  const float beyond = state_.to_go - stopping_distance(state_.velocity, state_.acceleration, limits);
  const bool stops_at_goal = std::abs(beyond) <= kReachedDistance;
  const bool backwards =
      stops_at_goal ? settled_velocity(state_.velocity, state_.acceleration, limits.jerk) < 0 : beyond < 0;
  const AxisState s = mirrored(state_, backwards);
  const float speed = backwards ? limits.speed_down : limits.speed_up;
  const JerkRange range = allowed_jerks(s.acceleration, limits, step_s);
  const float to_stop = largest_jerk(range, [&](float jerk) {
    const AxisState next = advanced(s, jerk, step_s);
    return next.to_go - stopping_distance(next.velocity, next.acceleration, limits);
  });
  const float to_speed = largest_jerk(range, [&](float jerk) {
    const AxisState next = advanced(s, jerk, step_s);
    return speed - settled_velocity(next.velocity, next.acceleration, limits.jerk);
  });
  const float jerk = min_f(to_stop, to_speed);
  state_ = advanced(state_, backwards ? -jerk : jerk, step_s);
}

void JerkLimitedAxis::step_to_velocity(float target, const AxisLimits& limits, float step_s) {
  const float goal = clamp_f(target, -limits.speed_down, limits.speed_up);
  const float change = limits.jerk * step_s;
  if (std::abs(goal - state_.velocity) <= change * step_s && std::abs(state_.acceleration) <= change) {
    state_.to_go -= step_s * goal;
    state_.velocity = goal;
    state_.acceleration = 0;
    return;
  }
  const bool backwards = settled_velocity(state_.velocity, state_.acceleration, limits.jerk) > goal;
  const AxisState s = mirrored(state_, backwards);
  const float wanted = backwards ? -goal : goal;
  const JerkRange range = allowed_jerks(s.acceleration, limits, step_s);
  const float jerk = largest_jerk(range, [&](float candidate) {
    const AxisState next = advanced(s, candidate, step_s);
    return wanted - settled_velocity(next.velocity, next.acceleration, limits.jerk);
  });
  state_ = advanced(state_, backwards ? -jerk : jerk, step_s);
}

}  // namespace hm
