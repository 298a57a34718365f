#pragma once
#include <vector>

#include "hm/odometry/registration/surface_alignment.hpp"

namespace hm {

/// Poses that follow the model's in the long run and the depth camera's surfaces from one frame to the next.
///
/// The model's poses come from the colour picture, which is not of the same moment as the depth picture
/// (rolling shutter, free-running cameras) and rarely registered to it exactly: they tremble by millimetres.
/// The motion between the surfaces of two depth pictures does not, but its small errors add up. A Kalman
/// filter of the pose: predicted by the surfaces' motion, corrected by the model's pose. How much the model's
/// poses tremble is measured: by how far their motion is from the surfaces' (innovation-based adaptation,
/// Mehra 1972). Where they agree, as with synchronous global shutters, the poses stay the model's.
class MotionFilter {
 public:
  explicit MotionFilter(const DepthNoise& noise) : noise_(noise) {}

  /// The pose of a frame, from the model's pose of it.
  SE3 update(const DepthGrid& grid, const SE3& T_odom_camera);
  /// The model has moved that frame's pose: the next motion is compared from there.
  void model_moved(const SE3& T_odom_camera) { T_odom_model_ = T_odom_camera; }
  /// Begins anew with a frame at a pose.
  void restart(const DepthGrid& grid, const SE3& T_odom_camera);
  /// Of the last pose against the model's (left perturbation in odom): what the trembling leaves.
  [[nodiscard]] Mat6 covariance_in_odom() const;
  [[nodiscard]] std::size_t memory_bytes() const { return surface_.capacity() * sizeof(SurfaceElement); }

 private:
  struct SurfaceMotion;
  [[nodiscard]] SurfaceMotion surface_motion(const DepthGrid& grid, const SE3& T_last_camera) const;
  void note_disagreement(const Vec6& disagreement, const Mat6& share_seen);
  [[nodiscard]] Mat6 model_information() const;

  DepthNoise noise_;
  std::vector<SurfaceElement> surface_;            ///< of the last frame
  SE3 T_odom_last_;                                ///< of the last frame, as given out
  SE3 T_odom_model_;                               ///< of the last frame, the model's
  Mat6 covariance_ = Mat6::Zero();                 ///< of T_odom_last_, perturbation in the camera's frame
  double translation_m2_ = 0, rotation_rad2_ = 0;  ///< mean square of the disagreement, an axis
  double frames_ = 0;                              ///< behind them, at most the memory
};

}  // namespace hm
