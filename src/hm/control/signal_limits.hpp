#pragma once
#include "hm/geometry/float/float_math.hpp"

namespace hm {

/// Lets a value follow its target by at most `rate_per_s`.
class SlewLimiter {
 public:
  void start_from(float value) { value_ = value; }
  float step(float target, float rate_per_s, float step_s) {
    const float most = rate_per_s * step_s;
    value_ = clamp_f(target, value_ - most, value_ + most);
    return value_;
  }
  [[nodiscard]] float value() const { return value_; }

 private:
  float value_ = 0;
};

/// Low pass of second order (Butterworth, bilinear transform with the cut-off frequency prewarped) of a
/// vector. The first sample after reset() passes unchanged, as if it had been there for ever.
class LowPass {
 public:
  /// A cut-off at or above 0.45 of the sampling frequency filters nothing.
  LowPass(float cutoff_hz, float step_s);
  void reset() { started_ = false; }
  const Vec3f& step(const Vec3f& input);
  [[nodiscard]] const Vec3f& value() const { return y1_; }

 private:
  float b_ = 1, a1_ = 0, a2_ = 0;
  bool started_ = false;
  Vec3f x1_ = Vec3f::Zero(), x2_ = Vec3f::Zero(), y1_ = Vec3f::Zero(), y2_ = Vec3f::Zero();
};

}  // namespace hm
