#pragma once
#include <optional>

#include "hm/geometry/se3.hpp"

namespace hm {

/// Kalman filter of a camera's pose and velocity with random accelerations (Bar-Shalom et al. 2001, 6.2.2),
/// as errors [translation; rotation] in the camera's own frame. What measurements leave free goes on at
/// constant velocity, and its covariance grows accordingly.
class PoseVelocityFilter {
 public:
  struct Prediction {
    SE3 T_odom_camera;
    Mat6 covariance = Mat6::Identity();  ///< perturbation in the camera's frame
  };

  PoseVelocityFilter() = default;
  /// Starts at a pose, which is taken as exact. `twist_s`: velocity in the camera's frame [m/s; rad/s], if
  /// known.
  PoseVelocityFilter(const SE3& T_odom_camera, const std::optional<Vec6>& twist_s);

  /// Pose after `duration_s`. `R_last_current`: rotation since the last update, from a gyroscope.
  [[nodiscard]] Prediction predict(double duration_s, const std::optional<Mat3>& R_last_current) const;
  /// Takes the pose after `duration_s` that was estimated from prediction and measurement; `information`: of
  /// the measurement alone, perturbation in the camera's frame (singular where it holds nothing).
  void update(double duration_s, const std::optional<Mat3>& R_last_current, const SE3& T_odom_camera,
              const Mat6& information);

  [[nodiscard]] const SE3& T_odom_camera() const { return T_odom_camera_; }
  [[nodiscard]] const Vec6& twist_s() const { return twist_s_; }
  [[nodiscard]] Mat6 covariance() const { return covariance_.topLeftCorner<6, 6>(); }

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(T_odom_camera_, twist_s_, covariance_);
  }

 private:
  using Mat12 = Eigen::Matrix<double, 12, 12>;
  struct Forecast {
    SE3 T_odom_camera;
    Mat12 covariance;
  };
  [[nodiscard]] Forecast forecast(double duration_s, const std::optional<Mat3>& R_last_current) const;

  SE3 T_odom_camera_;
  Vec6 twist_s_ = Vec6::Zero();
  Mat12 covariance_ = Mat12::Zero();  ///< of [pose; velocity]
};

}  // namespace hm
