#include "hm/odometry/tracker/row_motion.hpp"

namespace hm {
namespace {

constexpr int kRowIterations = 3;       // a row's time depends on the row: contracts by its motion, below 0.1
constexpr double kLeastDepth_m = 0.05;  // of a point in front of the camera
constexpr double kExtrapolation = 0.5;  // from the middle of an interval to its end, in intervals

/// Pixel of a point in an image to which T_image_camera transforms it; nothing if it is not in front of it.
std::optional<Vec2> pixel_in(const SE3& T_image_camera, const Vec3& p_camera, const PinholeCamera& camera) {
  const Vec3 p = T_image_camera * p_camera;
  if (!(p.z() > kLeastDepth_m)) return std::nullopt;
  return camera.project(p);
}

}  // namespace

RowMotion::RowMotion(const PinholeCamera& camera, const ColorTimes& times, const InstantMotion& motion)
    : camera_(camera),
      readout_s_(times.readout_s),
      motion_(motion),
      is_zero_(times.is_zero() || motion.is_zero()) {
  if (times.delay_s != 0) T_camera_depth_ = motion.until(-times.delay_s);
}

double RowMotion::time_s(double row) const {
  if (is_zero_) return 0;
  return (row / (camera_.height - 1) - 0.5) * readout_s_;
}

Vec2 RowMotion::at_middle_row(const Vec2& image_pixel, double depth_m) const {
  if (is_zero_ || readout_s_ == 0) return image_pixel;
  const SE3 T_middle_row = motion_.until(time_s(image_pixel.y()));
  return pixel_in(T_middle_row, camera_.unproject(image_pixel, depth_m), camera_).value_or(image_pixel);
}

Vec2 RowMotion::in_image(const Vec2& pixel, double depth_m) const {
  if (is_zero_ || readout_s_ == 0) return pixel;
  const Vec3 p = camera_.unproject(pixel, depth_m);
  Vec2 out = pixel;
  for (int i = 0; i < kRowIterations; ++i) {
    const auto moved = pixel_in(motion_.until(time_s(out.y())).inverse(), p, camera_);
    if (!moved) return pixel;
    out = *moved;
  }
  return out;
}

Vec2 RowMotion::in_depth_image(const Vec2& pixel, double depth_m) const {
  if (is_zero_) return pixel;
  return pixel_in(T_camera_depth_.inverse(), camera_.unproject(pixel, depth_m), camera_).value_or(pixel);
}

double RowMotion::depth_at_middle_row(const Vec2& depth_pixel, double reading_m) const {
  if (is_zero_) return reading_m;
  return (T_camera_depth_ * camera_.unproject(depth_pixel, reading_m)).z();
}

Vec6 mean_twist_s(const SE3& T_odom_before, const SE3& T_odom_now, double interval_s) {
  return (T_odom_before.inverse() * T_odom_now).log() / interval_s;
}

Vec6 RowMotionModel::mean_twist_until_s(const SE3& T_odom_camera) const {
  return mean_twist_s(T_odom_last, T_odom_camera, since_last_s);
}

std::optional<InstantMotion> RowMotionModel::motion_at(const SE3& T_odom_camera) const {
  if (!(since_last_s > 0)) return std::nullopt;
  const Vec6 mean_s = mean_twist_until_s(T_odom_camera);
  const Vec6 change_s2 =
      twist_before_s ? Vec6((mean_s - *twist_before_s) / since_last_s) : Vec6(Vec6::Zero());
  return InstantMotion{mean_s + kExtrapolation * since_last_s * change_s2, change_s2};
}

RowMotion RowMotionModel::rows_at(const SE3& T_odom_camera) const {
  if (is_zero()) return {};
  return {camera, times, *motion_at(T_odom_camera)};
}

SE3 RowMotionModel::steady_depth_motion(const SE3& T_odom_camera) const {
  if (is_zero() || times.delay_s == 0) return {};
  const Vec6 twist_s = mean_twist_until_s(T_odom_camera);
  return SE3::exp(-times.delay_s * 0.5 * (twist_s + twist_before_s.value_or(twist_s)));
}

double RowMotionModel::gain(double time_s) const {
  if (is_zero()) return 0;
  const double ratio = time_s / since_last_s;
  return twist_before_s ? ratio * (1 + kExtrapolation + 0.5 * ratio) : ratio;
}

double RowMotionModel::turn_sigma_rad_s(const SE3& T_odom_camera) const {
  if (is_zero() || !twist_before_s) return 0;
  const Vec6 twist_s = mean_twist_until_s(T_odom_camera);
  return kExtrapolation * (twist_s - *twist_before_s).tail<3>().norm();
}

}  // namespace hm
