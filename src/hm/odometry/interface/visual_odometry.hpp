#pragma once
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "hm/geometry/camera.hpp"
#include "hm/odometry/interface/odometry_params.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

struct Keyframe;

enum class TrackingStatus {
  kTracked,      ///< the pose is an answer of this frame
  kStarted,      ///< first frame of a submap: it defines it
  kRelocalised,  ///< found again against a keyframe
  kLost,         ///< no answer; the model is as it was
  kSkipped,      ///< the frame cannot be used (size, no colour, time not after the last one)
};
std::string_view to_string(TrackingStatus status);

/// What became of a frame's gravity.
enum class GravityUse { kNone, kUsed, kRejected };

/// What one frame offered and what was made of it: the numbers behind a status.
struct TrackingNumbers {
  int features = 0;                 ///< detected
  int features_with_depth = 0;      ///< certain enough to be used
  int matches = 0;                  ///< associated with the model (or the frame before)
  int inliers = 0;                  ///< of them, agreeing with the answer
  double sharpness = 0;             ///< variance of the image's Laplacian; low: motion blur, dark, no texture
  double depth_coverage_ratio = 0;  ///< pixels with a depth reading
  bool turn_given = false;          ///< by a gyroscope, for the prediction
  GravityUse gravity = GravityUse::kNone;
  std::size_t model_points = 0;  ///< in the persistent model after the frame
  double features_ms = 0, prediction_ms = 0, registration_ms = 0, model_ms = 0, total_ms = 0;  ///< Fig. 3.14
};

/// What is known of the motion besides the pictures.
struct MotionHint {
  std::optional<Mat3> R_last_current;  ///< rotation of the camera since the last frame (gyroscope)
  std::optional<Vec3> up_camera;       ///< the direction away from gravity in the camera frame, a unit vector
  /// What accelerometers felt since the last frame, on average: gravity and the camera's own acceleration,
  /// camera frame. Told apart by the tracker (gravity_estimator.hpp).
  std::optional<Vec3> force_camera_m_s2;
};

/// The answer for one frame.
struct TrackedFrame {
  TrackingStatus status = TrackingStatus::kLost;
  std::string reason;  ///< in words, with numbers, when there is no pose
  std::optional<SE3> T_odom_camera;
  Mat6 covariance =
      Mat6::Zero();  ///< of the pose: [translation; rotation] of a left perturbation exp(xi) T in `odom`
  int submap = 0;
  TrackingNumbers numbers;
  std::shared_ptr<const Keyframe> new_keyframe;  ///< set when this frame became one
};

/// RGB-D visual odometry on a persistent feature model (dissertation 3.2). `odom` is the camera of the first
/// frame, unless make_visual_odometry() was given that frame's pose. Lost for some time, it begins a new
/// submap, whose place relative to the one before is not known. A frame without an answer leaves the model
/// untouched. Deterministic but for the milliseconds. One thread calls it. Memory is bounded
/// (memory_bytes()).
class VisualOdometry {
 public:
  virtual ~VisualOdometry() = default;
  /// Tracks the next frame, in order of time. Depth and colour are free of lens distortion, registered to
  /// each other and of the camera's size; a frame that cannot be used is kSkipped, with the reason.
  virtual TrackedFrame track(const RgbdFrame& frame, const MotionHint& hint = {}) = 0;
  /// Bytes held by model and keyframes (bounded; see max_model_points, max_keyframes).
  [[nodiscard]] virtual std::size_t memory_bytes() const = 0;
};

}  // namespace hm
