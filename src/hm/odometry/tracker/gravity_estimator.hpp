#pragma once
#include <deque>
#include <optional>

#include "hm/odometry/tracker/tracker_frame.hpp"

namespace hm {

/// Gravity as a landmark at infinity: its direction in odom, learned from what accelerometers feel along the
/// tracked path, together with their bias in the camera's frame.
///
/// Over the last 1.5 s the mean of what was felt, turned into odom, is gravity plus the mean acceleration,
/// and that is the change of the velocity of the path, which is known: so a camera that is swung or walked
/// with does not mislead. What is left, y = g + M b with the mean rotation M, is linear in gravity g and bias
/// b: a Kalman filter of six numbers, fed once per stretch of time. A stretch that does not fit what is known
/// by the chi-squared test (a blow, a fall, a device that is turned otherwise than it is said to be), or
/// whose norm is not that of gravity, is rejected.
class GravityEstimator {
 public:
  /// A frame with a pose, and what was felt since the frame before. Stamps increase.
  void add(Time stamp, const SE3& T_odom_camera, const Vec3& force_camera_m_s2);
  /// The next frame's path does not follow on the last one's (lost, found again elsewhere).
  void interrupt() { path_.clear(); }
  /// Nothing that was learned is worth anything (a new submap).
  void reset();

  enum class Verdict { kTooEarly, kRejected, kUsed };
  struct Answer {
    Verdict verdict = Verdict::kTooEarly;
    UpPrior up;  ///< kUsed: without a deviation of its own, but that of what does not fit in `sigma_rad`
  };
  /// What a frame at about this pose says about up.
  [[nodiscard]] Answer observe(Time stamp, const SE3& T_odom_camera_guess,
                               const Vec3& force_camera_m_s2) const;

  [[nodiscard]] Vec3 gravity_odom_m_s2() const {
    return state_.head<3>();
  }  ///< points up; zero: not known yet
  [[nodiscard]] Vec3 bias_camera_m_s2() const { return state_.tail<3>(); }

 private:
  struct Sample {
    Time stamp;
    SE3 T_odom_camera;
    Vec3 force_camera = Vec3::Zero();  ///< of the interval that ends here
  };
  /// Mean of gravity and turned bias over the path, the mean rotation.
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
