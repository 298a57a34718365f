#include "hm/control/signal_limits.hpp"

namespace hm {

LowPass::LowPass(float cutoff_hz, float step_s) {
  if (cutoff_hz * step_s >= 0.45F) return;
  const auto [sine, cosine] = sin_cos_f(kPiF * cutoff_hz * step_s);
  const float k = sine / cosine, square = k * k;
  const float scale = 1 / (1 + 1.41421356F * k + square);
  b_ = square * scale;
  a1_ = 2 * (square - 1) * scale;
  a2_ = (1 - 1.41421356F * k + square) * scale;
}

const Vec3f& LowPass::step(const Vec3f& input) {
  if (!started_) {
    x1_ = x2_ = y1_ = y2_ = input;
    started_ = true;
    return y1_;
  }
  const bool passes = b_ == 1 && a1_ == 0;
  const Vec3f output = passes ? input : Vec3f(b_ * (input + 2 * x1_ + x2_) - a1_ * y1_ - a2_ * y2_);
  x2_ = x1_;
  x1_ = input;
  y2_ = y1_;
  y1_ = output;
  return y1_;
}

}  // namespace hm
