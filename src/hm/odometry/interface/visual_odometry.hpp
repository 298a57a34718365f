#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "hm/core/result.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/odometry/interface/odometry_params.hpp"
#include "hm/sensors/imu.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

struct Keyframe;
class StateReader;
class StateWriter;

enum class TrackingStatus {
  kTracked,      ///< the pose was estimated from this frame
  kStarted,      ///< first frame of a submap
  kRelocalised,  ///< relocalised against a keyframe
  kLost,         ///< no pose; the model is unchanged
  kSkipped,      ///< the frame is unusable (size, stamp not later than the last one, no colour)
  kBridged,      ///< the pose follows from inertial readings (and surfaces): the images show too little
};
std::string_view to_string(TrackingStatus status);

/// Use of a frame's gravity measurement.
enum class GravityUse { kNone, kUsed, kRejected };

/// Use of a frame's inertial readings (inertial_tracking.hpp).
enum class InertialUse {
  kNone,          ///< no gyroscope or accelerometer, or not asked for
  kLearning,      ///< biases, gravity and velocity are not known well enough yet
  kUsed,          ///< the readings predict the pose
  kInconsistent,  ///< rejected: predictions miss the visual poses by more than they should
  kWorse,         ///< rejected: predictions are worse than constant velocity
};

/// Statistics of tracking one frame.
struct TrackingNumbers {
  int features = 0;                 ///< detected
  int features_with_depth = 0;      ///< with a depth certain enough to be used
  int matches = 0;                  ///< associated with the model (or the previous frame)
  int inliers = 0;                  ///< matches consistent with the pose
  double sharpness = 0;             ///< variance of the image's Laplacian; low: blurred, dark or textureless
  double depth_coverage_ratio = 0;  ///< pixels with a depth reading
  bool turn_given = false;          ///< the prediction used a gyroscope
  bool by_depth = false;            ///< the pose comes from the depth image alone
  double by_depth_sigma_m = 0;      ///< `by_depth`: deviation of the position since the last known landmark
  GravityUse gravity = GravityUse::kNone;
  InertialUse inertial = InertialUse::kNone;
  double readout_s = 0, color_delay_s = 0;  ///< of the colour image, as used (TrackerParams)
  std::size_t model_points = 0;             ///< in the persistent model after the frame
  double features_ms = 0, prediction_ms = 0, registration_ms = 0, model_ms = 0, total_ms = 0;  ///< Fig. 3.14

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(features, features_with_depth, matches, inliers, sharpness, depth_coverage_ratio, turn_given,
            by_depth, by_depth_sigma_m);
    archive.choice(gravity, 3);
    archive.choice(inertial, 5);
    archive(readout_s, color_delay_s, model_points, features_ms, prediction_ms, registration_ms, model_ms,
            total_ms);
  }
};

/// Motion information in addition to the images.
struct MotionHint {
  std::optional<Mat3> R_last_current;  ///< rotation of the camera since the last frame (gyroscope)
  std::optional<Vec3> up_camera;       ///< unit vector opposite to gravity, camera frame
  /// Mean specific force since the last frame, camera frame: gravity and the camera's acceleration, separated
  /// by the tracker (gravity_estimator.hpp).
  std::optional<Vec3> force_camera_m_s2;
  /// Readings of gyroscope and accelerometer in the camera's frame, from before the last frame to after this
  /// one, for prediction (inertial_tracking.hpp); valid during the call.
  std::span<const ImuSample> readings;
};

/// Result for one frame.
struct TrackedFrame {
  TrackingStatus status = TrackingStatus::kLost;
  std::string reason;  ///< explanation when there is no pose
  std::optional<SE3> T_odom_camera;
  SE3 T_camera_depth;              ///< pose when the depth image was taken, relative to that of the frame
  Mat6 covariance = Mat6::Zero();  ///< of [translation; rotation] of a left perturbation exp(xi) T in `odom`
  int submap = 0;
  TrackingNumbers numbers;
  std::shared_ptr<const Keyframe> new_keyframe;  ///< set when this frame became a keyframe
};

/// Is told the pose T_odom_camera of a frame.
using OnPose = std::function<void(const SE3& T_odom_camera)>;

/// Frames and keyframes that a saved state refers to: the run's frames and the keyframes that it has made so
/// far, in order.
struct OdometryHistory {
  std::function<Result<RgbdFrame>(std::size_t frame_index)> read_frame;
  std::span<const std::shared_ptr<const Keyframe>> keyframes;
  /// Keyframe of a frame; null if it was none.
  [[nodiscard]] std::shared_ptr<const Keyframe> find_keyframe(std::size_t frame_index) const;
};

/// RGB-D visual odometry with a persistent feature model (dissertation 3.2). `odom` is the camera frame of
/// the first image, unless make_visual_odometry() was given that frame's pose. After being lost for some time
/// it starts a new submap with unknown pose relative to the previous one. A frame without a pose leaves the
/// model unchanged. Deterministic except for timings. Not thread safe. Memory is bounded (memory_bytes()).
class VisualOdometry {
 public:
  virtual ~VisualOdometry() = default;
  /// Tracks the next frame, in order of time. Depth and colour must be undistorted, registered to each other
  /// and of the camera's size; an unusable frame is kSkipped, with the reason. The tracker follows frames
  /// without colour by their depth images. `on_pose` is told the pose of the result as soon as it is known,
  /// before what the frame adds to the model is computed.
  virtual TrackedFrame track(const RgbdFrame& frame, const MotionHint& hint = {},
                             const OnPose& on_pose = {}) = 0;
  /// Memory of model and keyframes in bytes (bounded; see max_model_points, max_keyframes).
  [[nodiscard]] virtual std::size_t memory_bytes() const = 0;

  /// Writes everything that later frames depend on, except images, which are read from the recording again:
  /// restore() then continues to the bit. Does nothing and returns false for a method that cannot (the
  /// published ones).
  virtual bool save(StateWriter& state) const;
  /// Becomes the odometry that was saved; made with the same parameters and camera. Errors: the state is
  /// damaged (kCorrupted), a frame that it refers to cannot be read. Not to be used after an error.
  virtual Result<void> restore(StateReader& state, const OdometryHistory& history);
};

}  // namespace hm
