#pragma once
#include <optional>

#include "hm/geometry/camera.hpp"

namespace hm {

/// When the rows of a colour image are exposed, and how long after the depth image of its frame. Both are 0
/// for synchronous cameras with a global shutter.
struct ColorTimes {
  double readout_s = 0;  ///< from the first row to the last
  double delay_s = 0;    ///< from the depth image to the middle row; negative: colour is earlier
  [[nodiscard]] bool is_zero() const { return readout_s == 0 && delay_s == 0; }

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(readout_s, delay_s);
  }
};

/// Motion of the camera around the time of a frame, at constant acceleration.
struct InstantMotion {
  Vec6 twist_s = Vec6::Zero();    ///< velocity at that time, in the camera's frame [m/s; rad/s]
  Vec6 change_s2 = Vec6::Zero();  ///< its change [m/s^2; rad/s^2]

  [[nodiscard]] bool is_zero() const { return twist_s.isZero(0) && change_s2.isZero(0); }
  /// Pose of the camera at a time after the frame's (negative: before), relative to that at its time.
  [[nodiscard]] SE3 until(double time_s) const {
    return SE3::exp(time_s * (twist_s + 0.5 * time_s * change_s2));
  }

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(twist_s, change_s2);
  }
};

/// Motion of the camera during a frame. Moves pixels and depths between the images and
/// the camera's pose at the time of the middle row of the colour image, to which the tracker's poses and
/// landmarks refer.
class RowMotion {
 public:
  /// No motion: pixels and depths stay as they are, to the bit.
  RowMotion() = default;
  /// `camera` has no lens distortion.
  RowMotion(const PinholeCamera& camera, const ColorTimes& times, const InstantMotion& motion);

  [[nodiscard]] bool is_zero() const { return is_zero_; }
  /// Time of exposure of a row after the middle one.
  [[nodiscard]] double time_s(double row) const;
  /// Pixel of a point at the time of the middle row, where it has depth `depth_m`, from its pixel in the
  /// image.
  [[nodiscard]] Vec2 at_middle_row(const Vec2& image_pixel, double depth_m) const;
  /// The inverse: pixel in the colour image.
  [[nodiscard]] Vec2 in_image(const Vec2& pixel, double depth_m) const;
  /// Pose of the camera when the depth image was taken, relative to that at the middle row.
  [[nodiscard]] const SE3& T_camera_depth() const { return T_camera_depth_; }
  /// Pixel in the depth image of a point at the time of the middle row.
  [[nodiscard]] Vec2 in_depth_image(const Vec2& pixel, double depth_m) const;
  /// Depth at the time of the middle row of a reading of the depth image.
  [[nodiscard]] double depth_at_middle_row(const Vec2& depth_pixel, double reading_m) const;

 private:
  PinholeCamera camera_;
  double readout_s_ = 0;
  InstantMotion motion_;
  SE3 T_camera_depth_;
  bool is_zero_ = true;
};

/// Mean velocity between two poses, in the camera's frame [m/s; rad/s].
Vec6 mean_twist_s(const SE3& T_odom_before, const SE3& T_odom_now, double interval_s);

/// Motion at the end of the interval since the last pose, from the mean velocities over the last two
/// intervals.
struct RowMotionModel {
  PinholeCamera camera;
  ColorTimes times;
  SE3 T_odom_last;                     ///< pose of the last frame that has one
  double since_last_s = 0;             ///< time since then; 0: the velocity is unknown
  std::optional<Vec6> twist_before_s;  ///< mean velocity over the interval before

  [[nodiscard]] bool is_zero() const { return !(since_last_s > 0) || times.is_zero(); }
  /// Motion at the time of the frame, if the camera is here then; nothing if unknown.
  [[nodiscard]] std::optional<InstantMotion> motion_at(const SE3& T_odom_camera) const;
  /// Motion during the frame if the camera is here.
  [[nodiscard]] RowMotion rows_at(const SE3& T_odom_camera) const;
  /// T_camera_depth from the mean velocity over both intervals: late by a frame, but with a quarter of the
  /// noise.
  [[nodiscard]] SE3 steady_depth_motion(const SE3& T_odom_camera) const;
  /// Change of the motion until a time after the middle row with the camera's pose, since the velocity
  /// follows from the pose: d (motion) / d (pose).
  [[nodiscard]] double gain(double time_s) const;
  /// Standard deviation of the angular velocity, from its change over the last two intervals (rad/s).
  [[nodiscard]] double turn_sigma_rad_s(const SE3& T_odom_camera) const;

 private:
  [[nodiscard]] Vec6 mean_twist_until_s(const SE3& T_odom_camera) const;
};

}  // namespace hm
