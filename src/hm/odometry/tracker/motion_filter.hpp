#pragma once
#include <optional>
#include <vector>

#include "hm/odometry/registration/surface_alignment.hpp"

namespace hm {

/// Smooths poses: follows the model's poses in the long run and the motion of the depth surfaces from frame
/// to frame.
///
/// The model's poses come from the colour image, which is not synchronous with the depth image (rolling
/// shutter, free-running cameras) and not exactly registered to it: they jitter by millimetres. The motion
/// between two depth surfaces does not jitter, but its small errors accumulate. This Kalman filter of the
/// pose is predicted by the surfaces' motion and corrected by the model's pose. The jitter is estimated from
/// the change of the difference between both motions (after the innovation-based adaptation of Mehra 1972): a
/// difference that stays from frame to frame, as behind a person who walks ahead or with depth that bends, is
/// the surfaces' error, and counts for little. If both motions agree, as with synchronous global shutters,
/// the output equals the model's poses.
class MotionFilter {
 public:
  explicit MotionFilter(const DepthNoise& noise) : noise_(noise) {}

  /// Returns the filtered pose of a frame, given its pose in the model.
  SE3 update(const DepthGrid& grid, const SE3& T_odom_camera);
  /// Sets the last frame's pose after the model has changed it.
  void model_moved(const SE3& T_odom_camera) { T_odom_model_ = T_odom_camera; }
  /// Restarts with a frame at a pose.
  void restart(const DepthGrid& grid, const SE3& T_odom_camera);
  /// Covariance of the last output pose relative to the model's (left perturbation in odom).
  [[nodiscard]] Mat6 covariance_in_odom() const;
  /// All but the last frame's surface, which restore() gives.
  template <class Archive>
  void visit_state(Archive& archive) {
    archive(T_odom_last_, T_odom_model_, covariance_, disagreement_, translation_m2_, rotation_rad2_,
            frames_);
  }
  void restore(const DepthGrid& grid);
  [[nodiscard]] std::size_t memory_bytes() const { return surface_.capacity() * sizeof(SurfaceElement); }

 private:
  struct SurfaceMotion;
  [[nodiscard]] SurfaceMotion surface_motion(const DepthGrid& grid, const SE3& T_last_camera) const;
  void note_disagreement(const Vec6& disagreement, const Mat6& share_seen);
  [[nodiscard]] Mat6 model_information() const;

  DepthNoise noise_;
  std::vector<SurfaceElement> surface_;  ///< of the last frame
  SE3 T_odom_last_;                      ///< of the last frame, output
  SE3 T_odom_model_;                     ///< of the last frame, in the model
  Mat6 covariance_ = Mat6::Zero();       ///< of T_odom_last_, perturbation in the camera's frame
  std::optional<Vec6>
      disagreement_;  ///< of the last frame (m; rad; its camera's frame); empty after a restart
  double translation_m2_ = 0, rotation_rad2_ = 0;  ///< mean square of its change per axis
  double frames_ = 0;                              ///< effective number of frames in these means
};

}  // namespace hm
