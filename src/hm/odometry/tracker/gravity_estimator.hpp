#pragma once
#include <deque>
#include <optional>

#include "hm/odometry/tracker/tracker_frame.hpp"

namespace hm {

/// Estimates gravity in the odom frame from accelerometer measurements along the tracked path, together with
/// the accelerometer's bias in the camera frame. Gravity then acts as a landmark at infinity.
///
/// The mean specific force over the last 1.5 s, rotated into odom, is gravity plus the mean acceleration,
/// which is known from the change of the path's velocity; so the camera's motion does not bias the estimate.
/// The remainder y = g + M b, with the mean rotation M, is linear in gravity g and bias b: a Kalman filter
/// with six states, updated once per interval. An interval is rejected when it fails the chi-squared test
/// (impact, fall, wrong mounting rotation) or its norm is not that of gravity.
class GravityEstimator {
 public:
  /// Adds a frame with a pose and the mean specific force since the previous frame. Stamps must increase.
  void add(Time stamp, const SE3& T_odom_camera, const Vec3& force_camera_m_s2);
  /// Ends the current path, when the next frame does not continue it (lost, relocalised).
  void interrupt() { path_.clear(); }
  /// Resets the estimate (new submap).
  void reset();

  enum class Verdict { kTooEarly, kRejected, kUsed };
  struct Answer {
    Verdict verdict = Verdict::kTooEarly;
    UpPrior up;  ///< set for kUsed; `sigma_rad` is that of the inconsistency only
  };
  /// Up direction measured by a frame near this pose.
  [[nodiscard]] Answer observe(Time stamp, const SE3& T_odom_camera_guess,
                               const Vec3& force_camera_m_s2) const;

  [[nodiscard]] Vec3 gravity_odom_m_s2() const {
    return state_.head<3>();
  }  ///< points up; zero: not yet known
  [[nodiscard]] Vec3 bias_camera_m_s2() const { return state_.tail<3>(); }

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(path_, known_, updated_, state_, covariance_);
  }

 private:
  struct Sample {
    Time stamp;
    SE3 T_odom_camera;
    Vec3 force_camera = Vec3::Zero();  ///< of the interval that ends here

    template <class Archive>
    void visit_state(Archive& archive) {
      archive(stamp, T_odom_camera, force_camera);
    }
  };
  /// Interval of the path: mean of gravity and rotated bias, and mean rotation.
  struct Stretch {
    Vec3 mean = Vec3::Zero();
    Mat3 rotation = Mat3::Identity();
    double duration_s = 0;
  };
  [[nodiscard]] static std::optional<Stretch> stretch_of(const std::deque<Sample>& path);
  [[nodiscard]] bool plausible(const Stretch& stretch) const;
  [[nodiscard]] double squared_mahalanobis(const Stretch& stretch) const;
  void update(const Stretch& stretch);

  std::deque<Sample> path_;
  bool known_ = false;
  Time updated_;
  Vec6 state_ = Vec6::Zero();  ///< gravity in odom, bias in the camera's frame; m/s^2
  Mat6 covariance_ = Mat6::Zero();
};

}  // namespace hm
