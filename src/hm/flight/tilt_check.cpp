#include "hm/flight/tilt_check.hpp"

#include "hm/estimation/filter_math.hpp"

namespace hm {
namespace {

constexpr float kSmoothing_s = 0.4F;    // of both accelerations: poses are noisy
constexpr float kAveraging_s = 1.0F;    // of their products
constexpr float kLeast_m_s2 = 0.25F;    // of both: below it noise decides about the angle
constexpr float kLongestGap_s = 0.25F;  // between poses

float share_of(float dt_s, float time_constant_s) { return min_f(dt_s / time_constant_s, 1.0F); }

}  // namespace

void TiltCheck::add_pose(Time stamp, float x_m, float y_m) {
  const float dt_s = seconds_of<float>(stamp - stamp_);
  if (poses_ > 0 && dt_s > kLongestGap_s) poses_ = 0;
  const Planar velocity =
      poses_ > 0 ? Planar{(x_m - position_.x) / dt_s, (y_m - position_.y) / dt_s} : Planar{};
  if (poses_ > 1) {
    const float share = share_of(dt_s, kSmoothing_s);
    pose_acceleration_.x += share * ((velocity.x - velocity_.x) / dt_s - pose_acceleration_.x);
    pose_acceleration_.y += share * ((velocity.y - velocity_.y) / dt_s - pose_acceleration_.y);
  } else {
    pose_acceleration_ = {};
  }
  velocity_ = velocity;
  position_ = {x_m, y_m};
  stamp_ = stamp;
  if (poses_ < 2) ++poses_;
}

void TiltCheck::step(float x_m_s2, float y_m_s2, float dt_s) {
  const float share = share_of(dt_s, kSmoothing_s), slow = share_of(dt_s, kAveraging_s);
  tilt_acceleration_.x += share * (x_m_s2 - tilt_acceleration_.x);
  tilt_acceleration_.y += share * (y_m_s2 - tilt_acceleration_.y);
  const Planar &a = tilt_acceleration_, &b = pose_acceleration_;
  dot_ += slow * (a.x * b.x + a.y * b.y - dot_);
  cross_ += slow * (a.x * b.y - a.y * b.x - cross_);
}

std::optional<float> TiltCheck::mismatch_rad() const {
  if (norm_f(dot_, cross_) < kLeast_m_s2 * kLeast_m_s2) return {};
  return atan2_f(cross_, dot_);
}

}  // namespace hm
