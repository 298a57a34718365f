#pragma once
#include "hm/control/setpoint_shaper.hpp"
#include "hm/geometry/float/float_math.hpp"

namespace hm {

/// Position and velocity that a vehicle has at a moment if it follows a reference with a lag of first order
/// (time constant per axis): the reference through 1/(T s + 1). Feedback that compares the estimate with
/// this, while the acceleration is fed forward without lag, does not correct what is only late, and so does
/// not overshoot.
///
/// The lags are kept as differences from the reference, which are exact far from the origin.
class ExpectedResponse {
 public:
  ExpectedResponse(float horizontal_s, float vertical_s, float step_s)
      : time_s_(horizontal_s, horizontal_s, vertical_s), step_s_(step_s) {}
  /// The velocity that a reference has whose response is now at this velocity with this acceleration, for one
  /// axis; likewise for a position.
  [[nodiscard]] float ahead(int axis, float value, float rate) const { return value + time_s_[axis] * rate; }
  /// Starts an axis in steady state: the response is behind by the time constant times the rate.
  void start(int axis, const MotionReference& reference) {
    position_lag_m_[axis] = time_s_[axis] * reference.velocity_m_s[axis];
    velocity_lag_m_s_[axis] = time_s_[axis] * reference.acceleration_m_s2[axis];
  }
  void step(const MotionReference& reference) {
    for (int i = 0; i < 3; ++i) {
      const float share = step_s_ / (time_s_[i] + step_s_);
      position_lag_m_[i] = (position_lag_m_[i] + step_s_ * reference.velocity_m_s[i]) * (1 - share);
      velocity_lag_m_s_[i] = (velocity_lag_m_s_[i] + step_s_ * reference.acceleration_m_s2[i]) * (1 - share);
    }
  }
  [[nodiscard]] const Vec3f& position_lag_m() const { return position_lag_m_; }  ///< reference minus response
  [[nodiscard]] const Vec3f& velocity_lag_m_s() const {
    return velocity_lag_m_s_;
  }  ///< reference minus response

 private:
  Vec3f time_s_;
  float step_s_;
  Vec3f position_lag_m_ = Vec3f::Zero(), velocity_lag_m_s_ = Vec3f::Zero();
};

}  // namespace hm
