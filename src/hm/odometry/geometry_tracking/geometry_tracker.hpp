#pragma once
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "hm/core/result.hpp"
#include "hm/odometry/geometry_tracking/pose_velocity_filter.hpp"
#include "hm/odometry/geometry_tracking/surface_reference.hpp"

namespace hm {

/// A depth image to be tracked by its surfaces.
struct GeometryFrame {
  const DepthGrid* grid = nullptr;
  std::size_t index = 0;               ///< in the recording
  double since_last_s = 0;             ///< since the last pose
  std::optional<Mat3> R_last_current;  ///< rotation since then, from a gyroscope
  double color_delay_s = 0;            ///< from the depth image to the time that the frame's pose refers to
};

/// The last pose before tracking by surfaces begins.
struct GeometryStart {
  SE3 T_odom_camera;
  std::optional<Vec6> twist_s;     ///< velocity in the camera's frame [m/s; rad/s], if known
  Mat6 covariance = Mat6::Zero();  ///< left perturbation in odom
};

/// Result for a frame; nothing has changed until GeometryTracker::accept().
struct GeometryAttempt {
  SE3 T_odom_camera;
  SE3 T_camera_depth;
  Mat6 covariance = Mat6::Zero();         ///< left perturbation in odom
  Mat6 motion_covariance = Mat6::Zero();  ///< since the references, perturbation in the camera's frame
  Mat6 covariance_since_model =
      Mat6::Zero();           ///< since the model's keyframes, perturbation in the camera's frame
  bool keyframe_due = false;  ///< little of the view is shared with any reference
  double compared_ratio = 0, fitting_ratio = 0;  ///< as in ReferenceRegistration
  std::string refusal;                           ///< empty: the pose is valid
  /// Deviation of the position since the model's keyframes.
  [[nodiscard]] double sigma_m() const;
  /// Most readings are on known surfaces, agree with them, and hold the camera: nothing large moves by
  /// itself.
  [[nodiscard]] bool is_sure() const;

  PoseVelocityFilter filter;
  Mat6 covariance_in_model = Mat6::Zero(), start_covariance = Mat6::Zero();
};

/// Pose to which tracking by depth leads, and the covariance of its motion since the last keyframe
/// (perturbation in the camera's frame).
struct DepthArrival {
  SE3 T_odom_camera;
  Mat6 covariance;
};

/// Tracks frames by their depth images alone, when there is no colour image or nothing in it: against the
/// depth images of keyframes, with and without colour, that see the same surfaces. What these do not hold
/// follows the prediction at constant velocity, and the covariance says so. The model of landmarks is not
/// touched.
class GeometryTracker {
 public:
  explicit GeometryTracker(const DepthNoise& noise) : noise_(noise) {}

  /// The last frame with a pose was tracked by its surfaces.
  [[nodiscard]] bool is_active() const { return active_; }
  /// Enough depth to start or follow.
  [[nodiscard]] static bool is_usable(const DepthGrid& grid);

  /// Begins with this frame, without any reference.
  void begin(const GeometryStart& start, const GeometryFrame& frame);
  /// Estimates the pose of a frame. `start`: the last pose, unused if this tracker is active. `keyframes`:
  /// those of the model, at their present poses.
  [[nodiscard]] GeometryAttempt attempt(const GeometryStart& start, const GeometryFrame& frame,
                                        std::span<const SurfaceReference> keyframes) const;
  /// Takes the pose of an attempt without a refusal; the frame becomes a reference if that is due.
  void accept(const GeometryAttempt& attempt, const GeometryFrame& frame);
  /// Where it leads to in a frame whose pose landmarks have found; nothing if it is not active, or none of
  /// its frames became a reference. `T_odom_guess`: without an attempt that was right, the pose as last
  /// predicted.
  [[nodiscard]] std::optional<DepthArrival> arrival(const std::optional<GeometryAttempt>& attempt,
                                                    const SE3& T_odom_guess) const;
  /// Ends: the last pose comes from landmarks again.
  void end();

  [[nodiscard]] std::size_t memory_bytes() const;
  /// All but the depth images, which restore() reads again.
  template <class Archive>
  void visit_state(Archive& archive) {
    archive(active_, filter_, start_covariance_, next_identity_, references_);
  }
  Result<void> restore(const std::function<Result<DepthGrid>(std::size_t frame_index)>& read_grid);

 private:
  /// A frame without colour that others are compared with.
  struct OwnReference {
    std::uint64_t identity = 0;
    std::size_t frame_index = 0;
    SE3 T_odom_depth;
    Mat6 covariance = Mat6::Zero();
    DepthGrid grid;
    template <class Archive>
    void visit_state(Archive& archive) {
      archive(identity, frame_index, T_odom_depth, covariance);
    }
  };
  [[nodiscard]] const SurfaceGrid& surface_of(const SurfaceReference& reference) const;
  void add_reference(const GeometryFrame& frame, const SE3& T_odom_depth, const Mat6& covariance);

  DepthNoise noise_;
  bool active_ = false;
  PoseVelocityFilter filter_;             ///< of the depth camera, relative to the model
  Mat6 start_covariance_ = Mat6::Zero();  ///< of the model, when this began
  std::uint64_t next_identity_ = 0;
  std::deque<OwnReference> references_;
  mutable std::map<std::uint64_t, SurfaceGrid> surfaces_;  ///< of the references used last
};

}  // namespace hm
