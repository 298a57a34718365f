#include "hm/control/position_controller.hpp"

#include <cmath>

namespace hm {
namespace {

/// Least vertical thrust per weight: with less the rotors can hardly turn the vehicle upright again.
constexpr float kLeastVerticalThrustRatio = 0.3F;

}  // namespace

Vec3f limited_specific_force(const Vec3f& force_m_s2, float least_m_s2, float most_m_s2, float tilt_rad) {
  const float vertical = clamp_f(force_m_s2.z(), least_m_s2, most_m_s2);
  const auto [sine, cosine] = sin_cos_f(tilt_rad);
  const float room = std::sqrt(max_f(0, most_m_s2 * most_m_s2 - vertical * vertical));
  const float most = min_f(vertical * sine / max_f(cosine, 1e-3F), room);
  const float horizontal = norm_f(force_m_s2.x(), force_m_s2.y());
  const float share = horizontal > most ? most / horizontal : 1;
  return {share * force_m_s2.x(), share * force_m_s2.y(), vertical};
}

const Vec3f& PositionController::step(const PositionErrors& errors, float tilt_limit_rad) {
  const PositionParams& p = params_;
  Vec3f correction(p.position_xy_per_s * errors.position_m.x(), p.position_xy_per_s * errors.position_m.y(),
                   clamp_f(p.position_z_per_s * errors.position_m.z(), -p.correction_m_s, p.correction_m_s));
  const float speed = norm_f(correction.x(), correction.y());
  if (speed > p.correction_m_s) correction.head<2>() *= p.correction_m_s / speed;
  velocity_error_ = correction + errors.velocity_m_s;
  const Vec3f gains(p.velocity_xy_per_s, p.velocity_xy_per_s, p.velocity_z_per_s);
  wanted_ = errors.feed_forward_m_s2 + gains.cwiseProduct(velocity_error_) + integral_ +
            Vec3f(0, 0, kGravityF_m_s2);
  limited_ = limited_specific_force(wanted_, kLeastVerticalThrustRatio * kGravityF_m_s2,
                                    p.most_thrust_ratio * kGravityF_m_s2, tilt_limit_rad);
  return limited_;
}

void PositionController::applied(const Vec3f& specific_force_m_s2, bool horizontal, bool vertical) {
  const PositionParams& p = params_;
  const Vec3f missing = (specific_force_m_s2 - wanted_) / p.anti_windup_s;
  const auto next = [&](int i, float gain) {
    const bool unloads = missing[i] * integral_[i] < 0;
    const float rate = gain * velocity_error_[i] + (unloads ? missing[i] : 0);
    return clamp_f(integral_[i] + step_s_ * rate, -p.max_integral_m_s2, p.max_integral_m_s2);
  };
  if (horizontal) {
    integral_.x() = next(0, p.integral_xy_per_s2);
    integral_.y() = next(1, p.integral_xy_per_s2);
  }
  if (vertical) integral_.z() = next(2, p.integral_z_per_s2);
}

}  // namespace hm
